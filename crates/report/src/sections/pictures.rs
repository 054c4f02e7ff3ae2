//! Pictures: trees of the run, and one attempt moment by moment.

use maud::{Markup, html};

use super::Section;
use crate::pictures::{Pick, Picture, Pictures};

/// The section.
pub(crate) fn section(pictures: &Pictures) -> Section {
    let body = html! {
        @if let Some(reason) = &pictures.left_out { p.missing { (reason) } }
        @if !pictures.trees.is_empty() {
            p { "Trees of this run at the start, at the same scale." }
            div.pictures.trees { @for tree in &pictures.trees { (shown(tree)) } }
        }
        @if let Some(pick) = &pictures.pick { (one_pick(pick)) }
    };
    Section { id: "pictures", title: "Pictures", body }
}

fn shown(picture: &Picture) -> Markup {
    html! { figure { (picture.element()) figcaption { (picture.caption) } } }
}

fn one_pick(pick: &Pick) -> Markup {
    html! {
        h3 { (pick.title) }
        p {
            "The episode was simulated again from its record. The moments are in reading order; above is the view from outside (without leaves in \
             the foreground), below that of the wrist camera. Green circle: the true fruit; cross: the target as the controller believes it; \
             dots: the detections of the last image."
        }
        div.pictures.moments { @for moment in &pick.moments {
            figure {
                figcaption { strong { (moment.caption) } br; (moment.detail) }
                (moment.outside.element())
                (moment.wrist.element())
            }
        } }
    }
}
