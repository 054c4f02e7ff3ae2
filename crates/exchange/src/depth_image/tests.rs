use super::*;
use ::tiff::encoder::{TiffEncoder, colortype};
use std::io::{Cursor, Write};

/// A `.npy` file by hand, as NumPy writes it.
fn npy(descr: &str, fortran: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let mut header = format!("{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': {shape}, }}");
    while (10 + header.len() + 1) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(data);
    bytes
}

fn npz(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let packed =
        zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Deflated);
    for (name, bytes) in files {
        archive.start_file(*name, packed).unwrap();
        archive.write_all(bytes).unwrap();
    }
    archive.finish().unwrap().into_inner()
}

fn tiff_of<C: colortype::ColorType>(width: u32, height: u32, values: &[C::Inner]) -> Vec<u8>
where
    [C::Inner]: ::tiff::encoder::TiffValue,
{
    let mut bytes = Cursor::new(Vec::new());
    TiffEncoder::new(&mut bytes).unwrap().write_image::<C>(width, height, values).unwrap();
    bytes.into_inner()
}

/// Depths in metres in the usual unit, and the image's size.
fn depths(bytes: &[u8]) -> (Vec<f32>, (usize, usize)) {
    let raw = read(bytes).unwrap();
    let (size, unit) = (raw.size(), raw.usual_unit());
    (raw.depth(unit).unwrap().pixels().to_vec(), size)
}

fn told(bytes: &[u8]) -> String {
    read(bytes).unwrap_err().to_string()
}

fn le<const N: usize>(values: impl IntoIterator<Item = [u8; N]>) -> Vec<u8> {
    values.into_iter().flatten().collect()
}

#[test]
fn every_format_gives_the_same_depths() {
    let metres = [0.5_f32, 0.0, 1.25, 2.0, 0.001, 3.0];
    let millimetres = [500_u16, 0, 1250, 2000, 1, 3000];
    let expected = (metres.to_vec(), (3, 2));
    let png = depth_png::write(&DepthImage::from_pixels(3, 2, metres.to_vec()).unwrap(), MILLIMETRE).unwrap();
    let shorts = le(millimetres.map(u16::to_le_bytes));
    let singles = le(metres.map(f32::to_le_bytes));
    let array = npy("<f4", "False", "(2, 3)", &singles);
    for bytes in [
        png,
        tiff_of::<colortype::Gray16>(3, 2, &millimetres),
        tiff_of::<colortype::Gray32>(3, 2, &millimetres.map(u32::from)),
        tiff_of::<colortype::Gray32Float>(3, 2, &metres),
        tiff_of::<colortype::Gray64Float>(3, 2, &metres.map(f64::from)),
        npy("<u2", "False", "(2, 3)", &shorts),
        npy(">u2", "False", "(2, 3)", &le(millimetres.map(u16::to_be_bytes))),
        npy("<i4", "False", "(2, 3)", &le(millimetres.map(|v| i32::from(v).to_le_bytes()))),
        npy("<i8", "False", "(2, 3)", &le(millimetres.map(|v| i64::from(v).to_le_bytes()))),
        npy("<f8", "False", "(2, 3)", &le(metres.map(|v| f64::from(v).to_le_bytes()))),
        npy("<f4", "False", "(2, 3, 1)", &singles),
        npy("<f4", "False", "(1, 2, 3)", &singles),
        npy("<u2", "True", "(2, 3)", &le([500_u16, 2000, 0, 1, 1250, 3000].map(u16::to_le_bytes))),
        npz(&[("arr_0.npy", &array)]),
        npz(&[("colour.npy", b"x"), ("depth.npy", &array)]),
    ] {
        assert_eq!(depths(&bytes), expected);
    }
}

#[test]
fn what_is_no_positive_number_is_no_measurement() {
    let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, f32::MAX, 1e-46];
    let raw = read(&npy("<f4", "False", "(1, 6)", &le(odd.map(f32::to_le_bytes)))).unwrap();
    assert_eq!(raw.depth(1e3).unwrap().pixels(), [0.0; 6]);
    assert_eq!(depths(&npy("<i2", "False", "(1, 1)", &(-5_i16).to_le_bytes())), (vec![0.0], (1, 1)));
}

#[test]
fn errors_tell_format_and_problem() {
    let array = npy("<f4", "False", "(2, 3)", &[0; 24]);
    for (bytes, message) in [
        (Vec::new(), "is no PNG, TIFF, .npy or .npz file by its first bytes"),
        (b"\xff\xd8\xff\xe0 a JPEG".to_vec(), "is no PNG, TIFF"),
        (array[..array.len() - 1].to_vec(), "cannot be read as .npy array: it has fewer values"),
        (array[..9].to_vec(), "it ends within its header"),
        (
            npy("<f4", "False", "(6,)", &[0; 24]),
            "is a .npy array of shape [6]; two axes, rows and columns, is needed",
        ),
        (npy("<f4", "False", "(2, 3, 3)", &[0; 72]), "shape [2, 3, 3]"),
        (npy("<c8", "False", "(1, 1)", &[0; 8]), "is a .npy array of descr '<c8'"),
        (npy("<f4", "False", "(0, 3)", &[]), "is a file of 3 x 0 pixels"),
        (npy("<f4", "False", "(100000, 1)", &[]), "is 1 x 100000; at most"),
        (npy("<f4", "False", "(99999999999999999999, 1)", &[]), "its shape cannot be read"),
        (npy("<f4", "False", "2", &[]), "its shape cannot be read"),
        (b"\x93NUMPY\x02\x00\xff\xff\xff\xff".to_vec(), "its header has 4294967295 bytes"),
        (
            npz(&[("a.npy", &array), ("b.npy", &array)]),
            "the arrays a.npy, b.npy; one array, or one named depth,",
        ),
        (npz(&[("a.npy", b"text")]), "it ends within its header"),
        (b"PK\x03\x04 cut".to_vec(), "cannot be read as .npz archive"),
        (b"II*\0 cut".to_vec(), "cannot be read as TIFF"),
        (tiff_of::<colortype::RGB8>(1, 1, &[1, 2, 3]), "is a TIFF of rgb(8); one number a pixel"),
        (tiff_of::<colortype::Gray8>(1, 1, &[1]), "is a TIFF of gray(8); one number a pixel"),
    ] {
        let line = told(&bytes);
        assert!(line.contains(message), "{line}");
    }
}

/// A PNG of three values behind the header of `compressedDepth` with two parameters.
fn transported(values: [u16; 3], a: f32, b: f32) -> Vec<u8> {
    let image = Image::from_pixels(3, 1, values.to_vec()).unwrap();
    let mut bytes = vec![1, 0, 0, 0];
    bytes.extend(a.to_le_bytes());
    bytes.extend(b.to_le_bytes());
    bytes.extend(crate::image_png::write_grey16(&image).unwrap());
    bytes
}

#[test]
fn images_of_ros_transports_are_read() {
    let values = [0, 500, 1250];
    let data = transported(values, 0.0, 0.0);
    for (format, data) in [
        ("16UC1; compressedDepth png", &data[..]),
        ("16UC1; compressedDepth", &data),
        ("mono16; png compressed", &data[12..]),
        ("png", &data[12..]),
    ] {
        let raw = read_transported(format, data).unwrap();
        let unit = raw.usual_unit();
        assert_eq!(raw.depth(unit).unwrap().pixels(), [0.0, 0.5, 1.25], "{format}");
    }
    // a / (v - b) metres.
    let raw =
        read_transported("32FC1; compressedDepth png", &transported([0, 600, 300], 1000.0, 100.0)).unwrap();
    assert_eq!((raw.usual_unit(), raw.depth(1.0).unwrap().pixels()), (1.0, &[0.0, 2.0, 5.0][..]));
    // The pole and what lies behind it are no measurement.
    let raw =
        read_transported("32FC1; compressedDepth", &transported([100, 99, 101], 1000.0, 100.0)).unwrap();
    assert_eq!(raw.depth(1.0).unwrap().pixels(), [0.0, 0.0, 1000.0]);
}

#[test]
fn other_transports_are_told() {
    let data = transported([1, 2, 3], 1000.0, 100.0);
    let nan = transported([1, 2, 3], f32::NAN, 100.0);
    for (format, data, message) in [
        (
            "16UC1; compressedDepth rvl",
            &[0; 40][..],
            "is a compressed image of format \"16UC1; compressedDepth rvl\"; a PNG is needed",
        ),
        ("bgr8; jpeg compressed bgr8", b"\xff\xd8\xff\xe0 a JPEG", "a PNG is needed"),
        (
            "16UC1; compressedDepth png",
            &data[..11],
            "cannot be read as compressedDepth: it ends within its first 12 bytes",
        ),
        ("16UC1; compressedDepth png", &data[..40], "cannot be read as PNG"),
        ("32FC1; png compressed", &data[12..], "compressedDepth for values of 32FC1 is needed"),
        ("32FC1; compressedDepth png", &nan, "its parameters are NaN and 100; finite numbers are needed"),
        ("", b"", "a PNG is needed"),
    ] {
        let line = read_transported(format, data).unwrap_err().to_string();
        assert!(line.contains(message), "{line}");
    }
}
