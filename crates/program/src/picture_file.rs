//! Pictures as PNG files.

use std::path::Path;

use anyhow::Context;
use orchard_bench::store::{Store, write_bytes};
use orchard_geometry::Image;

use crate::failure::Failure;

/// Checks that the picture of the option `option` can be written and has a name that ends in .png; called before the slow drawing.
pub fn check(option: &str, out: &Path) -> Result<(), Failure> {
    check_folder_of(option, out)?;
    if out.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("png")) {
        let line =
            format!("{option} {}: pictures are PNG; a name that ends in .png is needed", out.display());
        return Err(Failure::BadInput(line));
    }
    Ok(())
}

/// Checks that the file of the option `option` can be written.
pub fn check_folder_of(option: &str, out: &Path) -> Result<(), Failure> {
    let bad = |problem: &str| Err(Failure::BadInput(format!("{option} {}: {problem}", out.display())));
    let folder = match out.parent() {
        None => return bad("not a file name"),
        Some(folder) if folder.as_os_str().is_empty() => Path::new("."),
        Some(folder) => folder,
    };
    if out.is_dir() {
        return bad("is a folder");
    }
    if !folder.is_dir() {
        return bad(&format!("there is no folder {}", folder.display()));
    }
    Ok(())
}

/// Writes a picture atomically.
pub fn write(out: &Path, image: &Image<[u8; 3]>) -> Result<(), Failure> {
    let bytes = png(image).context("cannot encode the picture")?;
    write_bytes(out, &bytes).map_err(|e| Failure::of_file(&e))
}

/// Writes a picture atomically under a folder.
pub fn write_in(folder: &Store, name: &str, image: &Image<[u8; 3]>) -> Result<(), Failure> {
    let bytes = png(image).context("cannot encode the picture")?;
    folder.write_bytes(name, &bytes).map_err(|e| Failure::Failed(e.to_string()))
}

/// A picture as PNG.
pub fn png(image: &Image<[u8; 3]>) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, image.width() as u32, image.height() as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::High);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&image.pixels().concat())?;
    writer.finish()?;
    Ok(bytes)
}

/// Copies one picture onto another, its upper left corner at a pixel.
pub fn paste(sheet: &mut Image<[u8; 3]>, image: &Image<[u8; 3]>, left: usize, top: usize) {
    for v in 0..image.height() {
        for u in 0..image.width() {
            sheet[(left + u, top + v)] = image[(u, v)];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_that_cannot_be_written_is_refused() {
        let refused = |out: &Path| match check("--out", out) {
            Err(Failure::BadInput(line)) => line,
            other => panic!("{}: {other:?}", out.display()),
        };
        let folder = std::env::temp_dir();
        assert!(
            check("--out", &folder.join("tree.png")).is_ok() && check("--out", Path::new("tree.PNG")).is_ok()
        );
        assert!(refused(&folder.join("no such folder").join("tree.png")).contains("no such folder"));
        assert!(refused(&folder).contains("is a folder"));
        assert!(refused(Path::new("/")).contains("--out"));
        assert!(refused(Path::new("x.txt")).contains("--out x.txt: pictures are PNG"));
        assert!(refused(Path::new("x")).contains("ends in .png"));
    }
}
