//! Search for the mesh files of a URDF.

use std::path::{Path, PathBuf};

use orchard_robot::MeshUse;

/// Searches every mesh; the error names the first missing one.
pub fn find_all(urdf: &Path, meshes: &[MeshUse]) -> Result<(), String> {
    let urdf = urdf.canonicalize().map_err(|e| e.to_string())?;
    for mesh in meshes {
        if !places(&urdf, &mesh.file).iter().any(|path| path.is_file()) {
            return Err(format!("link `{}`: mesh file `{}` does not exist", mesh.link, mesh.file));
        }
    }
    Ok(())
}

/// Paths that a file name in a URDF may refer to.
fn places(urdf: &Path, file: &str) -> Vec<PathBuf> {
    if let Some(path) = file.strip_prefix("file://") {
        return vec![PathBuf::from(path)];
    }
    let folders = urdf.ancestors().skip(1);
    let Some(path) = file.strip_prefix("package://") else {
        return folders.take(1).map(|folder| folder.join(file)).collect();
    };
    let Some((package, inside)) = path.split_once('/') else { return Vec::new() };
    let at = |folder: &Path| {
        let is_package = folder.file_name().is_some_and(|name| name == package);
        [Some(folder.join(path)), is_package.then(|| folder.join(inside))]
    };
    folders.flat_map(at).flatten().collect()
}
