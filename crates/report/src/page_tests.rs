//! Whole pages of a synthetic result.

use orchard_tasks::plan_file::Backend;
use orchard_tasks::protocol::Protocol;
use orchard_tasks::seeds::SeedSetName;
use scraper::{Html, Selector};

use crate::{Figures, PaperFigures, Pictures, Results, example, page};

fn drawn(results: &Results) -> Figures {
    Figures::draw(results, &Protocol::paper(), &PaperFigures::paper()).unwrap()
}

fn page_of(results: &Results, pictures: &Pictures) -> String {
    page(results, &drawn(results), pictures, &Protocol::paper(), &PaperFigures::paper())
}

fn select<'a>(html: &'a Html, selector: &str) -> Vec<scraper::ElementRef<'a>> {
    html.select(&Selector::parse(selector).unwrap()).collect()
}

/// Checks the elements that every page must have, however much data it has.
fn is_sound(text: &str) -> Html {
    let html = Html::parse_document(text);
    assert!(html.errors.is_empty(), "{:?}", html.errors);
    assert_eq!(select(&html, "html[lang]").len(), 1);
    assert_eq!(select(&html, "head title").len(), 1);
    for image in select(&html, "img") {
        assert!(image.attr("alt").is_some_and(|alt| !alt.is_empty()));
        assert!(image.attr("src").is_some_and(|source| source.starts_with("data:image/png;base64,")));
    }
    let mut ids: Vec<&str> = select(&html, "[id]").iter().filter_map(|e| e.attr("id")).collect();
    for svg in select(&html, "svg") {
        assert_eq!(svg.attr("role"), Some("img"));
        let words = svg.attr("aria-labelledby").unwrap();
        assert!(words.split(' ').all(|id| ids.contains(&id)), "{words}");
    }
    for link in select(&html, "a[href]") {
        let target = link.attr("href").and_then(|href| href.strip_prefix('#')).unwrap();
        assert!(ids.contains(&target), "{target}");
    }
    let all = ids.len();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), all, "an id stands twice");
    // Nothing to load and nothing to run.
    let elsewhere = text.replace("http://www.w3.org/2000/svg", "");
    for word in ["http:", "https:", "//cdn", "<script", "<link", "@import", "url(", "NaN", "inf "] {
        assert!(!elsewhere.contains(word), "{word}");
    }
    html
}

#[test]
fn every_section_is_there() {
    let results = example::results();
    let text = page_of(&results, &example::pictures());
    let html = is_sound(&text);
    let sections: Vec<&str> = select(&html, "section").iter().filter_map(|s| s.attr("id")).collect();
    assert_eq!(
        sections,
        [
            "run",
            "headline",
            "sweeps",
            "detection",
            "components",
            "zones",
            "attempts",
            "trees",
            "damage",
            "scaling",
            "compute",
            "pictures",
            "definitions"
        ]
    );
    assert!(select(&html, ".missing").is_empty(), "{:?}", select(&html, ".missing").len());
    // 3 sweeps of 6 panels, detection 4, zones 2, attempts 2, trees 2, damage 2, scaling 3.
    assert_eq!(select(&html, "svg").len(), 33);
    assert_eq!(select(&html, "img").len(), 3);
    // Undefined figures have their reason.
    let undefined = select(&html, "[title='no figure: there is nothing to measure']");
    assert!(undefined.iter().all(|cell| cell.text().collect::<String>() == "-") && !undefined.is_empty());
    // Requirements are judged only on all tuning seeds.
    assert!(text.contains(">met<") && text.contains("Requirements over the tuning seeds"));
}

#[test]
fn figures_of_the_page_are_the_files() {
    let results = example::results();
    let (figures, text) = (drawn(&results), page_of(&results, &Pictures::default()));
    for figure in figures.all() {
        assert!(text.contains(&figure.svg), "{}", figure.stem);
        assert!(figure.svg.starts_with("<svg ") && figure.svg.ends_with("</svg>"), "{}", figure.stem);
        assert!(
            !figure.description.contains("NaN") && figure.description.ends_with('.'),
            "{}",
            figure.description
        );
    }
    let mut stems: Vec<&String> = figures.all().map(|figure| &figure.stem).collect();
    let all = stems.len();
    stems.sort();
    stems.dedup();
    assert_eq!(stems.len(), all);
}

#[test]
fn the_same_bytes_twice() {
    let (once, again) = (example::results(), example::results());
    assert!(page_of(&once, &example::pictures()) == page_of(&again, &example::pictures()));
}

#[test]
fn empty_parts_say_what_would_fill_them() {
    let whole = example::results();
    let mut harvest = whole.harvest.clone();
    if let Some(harvest) = &mut harvest {
        harvest.sweeps.clear();
    }
    let only_harvest = Results { harvest, ..Results::default() };
    let text =
        page_of(&only_harvest, &Pictures { left_out: Some("not asked for".into()), ..Pictures::default() });
    let html = is_sound(&text);
    // 3 sweeps, detection, components, scaling, compute, pictures.
    assert_eq!(select(&html, ".missing").len(), 8);
    assert!(text.contains("cargo xtask bench-v1 --profile full --conditions foliage"));
    let only_detect = Results { detect: whole.detect, ..Results::default() };
    let html = is_sound(&page_of(&only_detect, &Pictures::default()));
    assert_eq!(select(&html, "svg").len(), 4);
    is_sound(&page_of(&Results::default(), &Pictures::default()));
}

#[test]
fn warnings_stand_on_top() {
    let first = |results: &Results| -> Vec<String> {
        let html = is_sound(&page_of(results, &Pictures::default()));
        let main = select(&html, "main > *");
        assert!(main[0].attr("class") == Some("warnings") || select(&html, ".warnings").is_empty());
        select(&html, ".warnings p").iter().map(|p| p.text().collect()).collect()
    };
    let mut results = example::results();
    assert!(first(&results)[0].starts_with("Tuning seeds (harvest, detect, reach-and-grasp, gentle)."));
    if let Some(harvest) = &mut results.harvest {
        harvest.quarantined = 2;
        harvest.seed_set.name = SeedSetName::V1;
    }
    let warnings = first(&results);
    assert!(warnings[0].starts_with("2 worlds were quarantined."), "{warnings:?}");
    // Official seeds, but each tree only once.
    assert!(
        warnings.iter().any(|line| line.starts_with("Not the official time or repeats.")),
        "{warnings:?}"
    );
    let mut official = example::results();
    official.detect = None;
    official.components.clear();
    if let Some(harvest) = &mut official.harvest {
        harvest.seed_set.name = SeedSetName::V1;
        if let Some(nominal) = harvest.conditions.get_mut("nominal") {
            nominal.params.repeats = 3;
        }
    }
    assert_eq!(first(&official), [""; 0]);
}

/// A run without attempts, deposits and drops: all figures are drawn, and none of their numbers is made up.
#[test]
fn a_run_in_which_nothing_happened() {
    let mut results = example::results();
    for condition in results.harvest.iter_mut().flat_map(|h| h.conditions.values_mut()) {
        for episode in &mut condition.episodes {
            (episode.attempts, episode.deposited, episode.dropped, episode.snapped) = (0, 0, 0, 0);
        }
        condition.failures.clear();
        condition.states.clear();
        condition.between_attempts_s = None;
        for metric in condition.metrics.values_mut() {
            (metric.mean, metric.ci95, metric.n) = (None, [None, None], 0);
        }
    }
    let html = is_sound(&page_of(&results, &Pictures::default()));
    assert_eq!(select(&html, "#attempts .missing").len(), 1);
}

/// Both backends share one figure with the paper's points; omitted cells and the cost of each kind of randomisation are reported.
#[test]
fn scaling_on_both_backends() {
    let mut results = example::results();
    let of_cpu = drawn(&results).scaling[0].description.clone();
    assert!(of_cpu.contains("lanes: ") && of_cpu.contains("aba: ") && !of_cpu.contains("device"));
    results.scaling.push(example::scaling(Backend::Gpu));
    let throughput = &drawn(&results).scaling[0];
    // The fastest solver of each.
    let told = &throughput.description;
    assert!(told.contains("lanes: ") && told.contains("device aba: ") && !told.contains(", aba: "), "{told}");
    assert!(throughput.svg.contains("32768") && throughput.svg.contains("paper: distinct dimensions"));
    let text = page_of(&results, &Pictures::default());
    let html = is_sound(&text);
    let scaling = &select(&html, "#scaling")[0];
    let words: String = scaling.text().collect();
    for phrase in [
        "2 threads, lanes of avx2; Device.",
        "Newton up to 256 worlds, 2 to 3 times slower",
        "device-aba, distinct topology, 65536 worlds: estimated time 90 s",
        "habit-angles",
    ] {
        assert!(words.contains(phrase), "{phrase}");
    }
    let solvers: Vec<String> = select(&html, "#scaling td:first-child, #scaling th[scope='row']")
        .iter()
        .map(|cell| cell.text().collect())
        .collect();
    assert!(["lanes", "aba", "device-aba"].iter().all(|name| solvers.iter().any(|cell| cell == name)));
}
