//! The page: one self-contained HTML file without scripts.

use maud::{DOCTYPE, Markup, PreEscaped, html};
use orchard_tasks::protocol::Protocol;

use crate::figures::Figures;
use crate::pictures::Pictures;
use crate::published::PaperFigures;
use crate::results::Results;
use crate::sections::{
    Section, canopy, components, conditions, cost, definitions, detection, head, headline, pictures, sweeps,
};

const STYLE: &str = include_str!("style.css");

/// The page of a result as self-contained HTML. The same results give the same bytes.
pub fn page(
    results: &Results,
    figures: &Figures,
    shown: &Pictures,
    protocol: &Protocol,
    paper: &PaperFigures,
) -> String {
    let mut sections = vec![headline::section(results, protocol)];
    sections.extend(conditions::section(results, figures));
    sections.extend([
        sweeps::section(results, figures, protocol),
        detection::section(results, figures, protocol),
        components::section(results),
        canopy::zones(results, figures, paper),
        canopy::attempts(results, figures),
        canopy::trees(results, figures, paper),
        canopy::damage(results, figures),
        cost::scaling(results, figures),
        cost::compute(results),
        pictures::section(shown),
        definitions::section(),
    ]);
    let warnings = head::warnings(results, protocol);
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (head::title(results)) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                header {
                    h1 { (head::title(results)) }
                    p.subtitle { (head::subtitle(results)) }
                }
                main {
                    @if !warnings.is_empty() {
                        aside.warnings role="note" aria-label="Warnings" {
                            @for warning in &warnings { p { (warning) } }
                        }
                    }
                    (contents(&sections))
                    section id="run" { h2 { "What was run" } (head::facts(results)) }
                    @for section in &sections { section id=(section.id) { h2 { (section.title) } (section.body) } }
                }
                footer { p { "The figures of this page are in the folder figures as SVG. Made by orchard report." } }
            }
        }
    };
    markup.into_string() + "\n"
}

fn contents(sections: &[Section]) -> Markup {
    html! {
        nav aria-label="Contents" { ul {
            li { a href="#run" { "What was run" } }
            @for section in sections { li { a href={ "#" (section.id) } { (section.title) } } }
        } }
    }
}
