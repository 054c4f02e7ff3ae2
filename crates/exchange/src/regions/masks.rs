//! Masks: polygons, run lengths and labels, as pixels of the smallest box around them.

use std::collections::BTreeMap;

use orchard_geometry::Image;
use serde_json::Value;

use super::{MOST_REGIONS, Region, RegionError, refuse};

/// Most corners of a polygon; the outline of the largest image has 65,536 pixels.
const MOST_CORNERS: usize = 65_536;

/// First column, first row, and pixels.
type Mask = (usize, usize, Image<bool>);

pub(super) fn read(field: &str, value: &Value, size: (usize, usize)) -> Result<Mask, RegionError> {
    match value {
        Value::Array(polygons) => of_polygons(field, polygons, size),
        Value::Object(rle) => {
            let stated: Option<Vec<u64>> = rle
                .get("size")
                .and_then(Value::as_array)
                .map(|s| s.iter().filter_map(Value::as_u64).collect());
            if stated.as_deref() != Some(&[size.1 as u64, size.0 as u64]) {
                let found = rle.get("size").unwrap_or(&Value::Null);
                return refuse(
                    &format!("{field}.size"),
                    format!("{found} is not [{}, {}], the image's rows and columns", size.1, size.0),
                );
            }
            let field = format!("{field}.counts");
            let runs = match rle.get("counts") {
                Some(Value::Array(list)) => list.iter().map(Value::as_u64).collect(),
                Some(Value::String(text)) => unpacked(text),
                _ => None,
            };
            match runs {
                Some(runs) => of_runs(&field, &runs, size),
                None => refuse(&field, "must be a list of whole numbers or text as pycocotools packs them"),
            }
        }
        _ => refuse(field, "must be a list of polygons or run lengths with size and counts"),
    }
}

/// Run lengths from text: numbers of 5 bits a letter, the lowest first, from the fourth on as difference to the one before the last
/// (`rleFrString` of the COCO API). `None` if the text is none.
fn unpacked(text: &str) -> Option<Vec<u64>> {
    let mut runs: Vec<i64> = Vec::new();
    let mut letters = text.bytes();
    while let Some(first) = letters.next() {
        let (mut value, mut shift, mut letter) = (0_i64, 0_u32, first);
        loop {
            let bits = i64::from(letter.checked_sub(48).filter(|bits| *bits < 64)?);
            value |= (bits & 0x1f).checked_shl(shift).filter(|_| shift < 50)?;
            shift += 5;
            if bits & 0x20 == 0 {
                if bits & 0x10 != 0 {
                    value |= -1 << shift;
                }
                break;
            }
            letter = letters.next()?;
        }
        let before = if runs.len() > 2 { runs[runs.len() - 2] } else { 0 };
        runs.push(value.checked_add(before)?);
    }
    runs.into_iter().map(|run| u64::try_from(run).ok()).collect()
}

/// Mask of runs that go down the columns: out, in, out, ...
fn of_runs(field: &str, runs: &[u64], (width, height): (usize, usize)) -> Result<Mask, RegionError> {
    let total = runs.iter().try_fold(0_u64, |sum, run| sum.checked_add(*run));
    if total != Some((width * height) as u64) {
        return refuse(field, format!("the runs do not fill the image of {width} x {height}"));
    }
    let mut start = 0;
    // Columns and rows of the runs inside; a run of more than one column spans all rows.
    let mut spans = Vec::new();
    let mut ends = (usize::MAX, usize::MAX, 0, 0);
    for (i, &run) in runs.iter().enumerate() {
        let end = start + run as usize;
        if i % 2 == 1 && run > 0 {
            spans.push((start, end));
            let (first, last) = (start / height, (end - 1) / height);
            let rows = if first == last { (start % height, (end - 1) % height) } else { (0, height - 1) };
            ends = (ends.0.min(first), ends.1.min(rows.0), ends.2.max(last), ends.3.max(rows.1));
        }
        start = end;
    }
    if spans.is_empty() {
        return refuse(field, "holds no pixel");
    }
    let (left, top, right, bottom) = ends;
    let mut mask = Image::filled(right - left + 1, bottom - top + 1, false);
    for i in spans.into_iter().flat_map(|(start, end)| start..end) {
        mask[(i / height - left, i % height - top)] = true;
    }
    Ok((left, top, mask))
}

/// Union of polygons: pixels whose centres lie inside by the even-odd rule.
fn of_polygons(
    field: &str,
    polygons: &[Value],
    (width, height): (usize, usize),
) -> Result<Mask, RegionError> {
    let mut shapes: Vec<Vec<(f64, f64)>> = Vec::new();
    for (i, polygon) in polygons.iter().enumerate() {
        let numbers: Option<Vec<f64>> =
            polygon.as_array().and_then(|list| list.iter().map(Value::as_f64).collect());
        match numbers {
            Some(numbers) if numbers.len() > 2 * MOST_CORNERS => {
                return refuse(&format!("{field}[{i}]"), format!("has more than {MOST_CORNERS} corners"));
            }
            Some(numbers) if numbers.len() >= 6 && numbers.len() % 2 == 0 => {
                // The centre of the first pixel is at (0.5, 0.5).
                shapes.push(numbers.as_chunks::<2>().0.iter().map(|[x, y]| (x - 0.5, y - 0.5)).collect());
            }
            _ => return refuse(&format!("{field}[{i}]"), "must be at least three pairs x, y"),
        }
    }
    let points = || shapes.iter().flatten();
    let ends = |of: fn(&(f64, f64)) -> f64, size: usize| {
        let low = points().map(of).fold(f64::INFINITY, f64::min);
        let high = points().map(of).fold(f64::NEG_INFINITY, f64::max);
        let first = (low.ceil().max(0.0) as usize).min(size);
        (first, ((high.floor() + 1.0).max(0.0) as usize).clamp(first, size))
    };
    let ((left, right), (top, bottom)) = (ends(|p| p.0, width), ends(|p| p.1, height));
    let mut mask = Image::filled(right - left, bottom - top, false);
    for shape in &shapes {
        for row in top..bottom {
            let v = row as f64;
            let edges = shape.iter().zip(shape.iter().cycle().skip(1));
            let cross = |(a, b): (&(f64, f64), &(f64, f64))| {
                ((a.1 <= v) != (b.1 <= v)).then(|| a.0 + (v - a.1) / (b.1 - a.1) * (b.0 - a.0))
            };
            let mut crossings: Vec<f64> = edges.filter_map(cross).collect();
            crossings.sort_by(f64::total_cmp);
            for pair in crossings.as_chunks::<2>().0 {
                let first = (pair[0].ceil().max(left as f64) as usize).min(right);
                let end = ((pair[1].ceil()).max(0.0) as usize).clamp(first, right);
                (first..end).for_each(|column| mask[(column - left, row - top)] = true);
            }
        }
    }
    if !mask.pixels().contains(&true) {
        return refuse(field, format!("holds no pixel of the image of {width} x {height}"));
    }
    Ok((left, top, mask))
}

/// A region for each label but 0, by rising label.
pub(super) fn by_label(labels: &Image<u16>) -> Result<Vec<Region>, RegionError> {
    // Ends of columns and rows.
    let mut boxes: BTreeMap<u16, [usize; 4]> = BTreeMap::new();
    let places = || (0..labels.height()).flat_map(|v| (0..labels.width()).map(move |u| (u, v)));
    for (u, v) in places() {
        let label = labels[(u, v)];
        if label > 0 {
            let [left, top, right, bottom] = boxes.entry(label).or_insert([u, v, u, v]);
            (*left, *top, *right, *bottom) =
                ((*left).min(u), (*top).min(v), (*right).max(u), (*bottom).max(v));
        }
    }
    if boxes.len() > MOST_REGIONS {
        return Err(RegionError::TooMany { found: boxes.len() });
    }
    let mut regions: BTreeMap<u16, Region> = boxes
        .into_iter()
        .map(|(label, [left, top, right, bottom])| {
            let inside = Image::filled(right - left + 1, bottom - top + 1, false);
            (label, Region { left, top, inside, score: None })
        })
        .collect();
    for (u, v) in places() {
        if let Some(region) = regions.get_mut(&labels[(u, v)]) {
            region.inside[(u - region.left, v - region.top)] = true;
        }
    }
    Ok(regions.into_values().collect())
}
