//! Mesh files of a URDF, found within the folders that may be read.

use std::path::{Component, Path, PathBuf};

use orchard_robot::Resources;

/// Names of folders that hold the URDF files of a package, beside its meshes.
const URDF_FOLDERS: [&str; 5] = ["urdf", "urdfs", "robot", "robots", "xacro"];

/// File that makes a folder a package of ROS.
const MANIFEST: &str = "package.xml";

/// Mesh files for one URDF. All paths are canonical, so no `..` and no link leads out of them.
#[derive(Debug)]
pub struct MeshFiles {
    /// Folder of the URDF.
    home: PathBuf,
    /// Folders with packages, as the user named them.
    packages: Vec<PathBuf>,
    /// Folders that may be read.
    roots: Vec<PathBuf>,
    /// Size of all files read \[bytes\].
    pub bytes: usize,
}

impl MeshFiles {
    /// Files for a URDF file, with further folders that hold packages.
    ///
    /// # Errors
    /// A line with the name of the file or folder that is not there.
    pub fn new(urdf: &Path, package_paths: &[PathBuf]) -> Result<Self, String> {
        let canonical = |path: &Path, option: &str| {
            path.canonicalize().map_err(|e| format!("{option}{}: {e}", path.display()))
        };
        let file = canonical(urdf, "")?;
        let home = file.parent().unwrap_or(&file).to_owned();
        let mut packages = Vec::new();
        for path in package_paths {
            let folder = canonical(path, "package path ")?;
            if !folder.is_dir() {
                return Err(format!("package path {}: is no folder", path.display()));
            }
            packages.push(folder);
        }
        let mut roots = packages.clone();
        let own = home.ancestors().find(|folder| folder.join(MANIFEST).is_file());
        let above = home.parent().filter(|_| URDF_FOLDERS.iter().any(|name| is_named(&home, name)));
        roots.extend([Some(home.as_path()), own, above].into_iter().flatten().map(Path::to_owned));
        Ok(Self { home, packages, roots, bytes: 0 })
    }

    /// The file that a name in the URDF refers to.
    fn place(&self, name: &str) -> Result<PathBuf, String> {
        let (found, mut is_outside) = match strip_package(name) {
            Some((package, inside)) => self.in_package(package, inside),
            None => {
                let path = Path::new(name.strip_prefix("file://").unwrap_or(name));
                let folders = std::iter::once(&self.home).chain(&self.packages);
                self.first(folders.map(|folder| (folder.join(path), None)))
            }
        };
        if let Some(path) = found {
            return Ok(path);
        }
        // What is not there cannot be told from what must not be read, but for its name.
        is_outside |= Path::new(name).components().any(|part| part == Component::ParentDir);
        Err(match is_outside {
            true => "it lies outside the folders that may be read, those of the URDF's package and of --package-path DIR".to_owned(),
            false => "there is no such file; --package-path DIR names the folder that holds it or its package".to_owned(),
        })
    }

    /// The file `inside` a package: in a folder of `--package-path`, in a folder of this name that the URDF lies in, or in a package of this
    /// name beside one of the URDF's folders.
    fn in_package(&self, package: &str, inside: &str) -> (Option<PathBuf>, bool) {
        let of_user = self.packages.iter().flat_map(|folder| {
            let own = is_named(folder, package).then(|| folder.join(inside));
            [Some(folder.join(package).join(inside)), own].into_iter().flatten().map(|path| (path, None))
        });
        let around = self.home.ancestors().filter_map(|folder| {
            let beside = folder.join(package);
            let root = match is_named(folder, package) {
                true => folder.to_owned(),
                false => Some(beside).filter(|beside| beside.join(MANIFEST).is_file())?,
            };
            Some((root.join(inside), root.canonicalize().ok()))
        });
        self.first(of_user.chain(around))
    }

    /// The first path that is a file and lies within a folder that may be read, or within the one beside it; and true if any file lies
    /// outside.
    fn first(&self, paths: impl Iterator<Item = (PathBuf, Option<PathBuf>)>) -> (Option<PathBuf>, bool) {
        let mut is_outside = false;
        for (path, own) in paths {
            let Ok(path) = path.canonicalize() else { continue };
            if !path.is_file() {
                continue;
            }
            if self.roots.iter().chain(&own).any(|root| path.starts_with(root)) {
                return (Some(path), false);
            }
            is_outside = true;
        }
        (None, is_outside)
    }
}

impl Resources for MeshFiles {
    fn read(&mut self, name: &str) -> Result<Vec<u8>, String> {
        let bytes =
            orchard_input::bytes(&self.place(name)?, orchard_input::MESH).map_err(|e| e.to_string())?;
        self.bytes += bytes.len();
        Ok(bytes)
    }

    fn find(&mut self, name: &str) -> Result<(), String> {
        self.place(name).map(|_| ())
    }
}

fn is_named(folder: &Path, name: &str) -> bool {
    folder.file_name().is_some_and(|own| own == name)
}

/// Package and path of a name such as `package://my_arm/meshes/base.stl`.
fn strip_package(name: &str) -> Option<(&str, &str)> {
    let path = name.strip_prefix("package://").or_else(|| name.strip_prefix("model://"))?;
    path.trim_start_matches('/').split_once('/')
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    /// Two packages side by side, a file outside of both, and a URDF in one.
    fn workspace() -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        for (path, text) in [
            ("src/arm/package.xml", "<package/>"),
            ("src/arm/urdf/robot.urdf", "<robot/>"),
            ("src/arm/meshes/a.stl", "a"),
            ("src/hand/package.xml", "<package/>"),
            ("src/hand/meshes/b.stl", "b"),
            ("src/plain/c.stl", "c"),
            ("other/legs/d.stl", "d"),
            ("secret.stl", "s"),
        ] {
            let path = folder.path().join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        let urdf = folder.path().join("src/arm/urdf/robot.urdf");
        (folder, urdf)
    }

    #[test]
    fn names_are_found_in_packages_and_beside_the_urdf() {
        let (folder, urdf) = workspace();
        let mut files = MeshFiles::new(&urdf, &[]).unwrap();
        let absolute = folder.path().canonicalize().unwrap().join("src/arm/meshes/a.stl");
        for (name, text) in [
            ("package://arm/meshes/a.stl", "a"),
            ("package:///arm/meshes/a.stl", "a"),
            ("model://arm/meshes/a.stl", "a"),
            ("../meshes/a.stl", "a"),
            ("package://hand/meshes/b.stl", "b"),
            (&format!("file://{}", absolute.display()), "a"),
            (&absolute.display().to_string(), "a"),
        ] {
            assert_eq!(files.read(name).unwrap(), text.as_bytes(), "{name}");
        }
        assert_eq!(files.bytes, 7);
        for path in ["other", "other/legs"] {
            let mut files = MeshFiles::new(&urdf, &[folder.path().join(path)]).unwrap();
            assert_eq!(files.read("package://legs/d.stl").unwrap(), b"d");
        }
        let missing = files.read("package://legs/d.stl").unwrap_err();
        assert!(missing.contains("--package-path"), "{missing}");
        let bad = MeshFiles::new(&urdf, &[folder.path().join("nowhere")]).unwrap_err();
        assert!(bad.contains("package path"), "{bad}");
    }

    #[test]
    fn no_name_leads_out_of_the_folders() {
        let (folder, urdf) = workspace();
        let mut files = MeshFiles::new(&urdf, &[folder.path().join("other")]).unwrap();
        let secret = folder.path().join("secret.stl");
        for name in [
            "../../../secret.stl",
            "package://arm/../../secret.stl",
            "package://../secret.stl",
            "package://legs/../../secret.stl",
            // A folder beside the package that is no package.
            "package://plain/c.stl",
            &format!("file://{}", secret.display()),
            &secret.display().to_string(),
            "/etc/passwd",
            "package://etc/passwd",
            "",
        ] {
            assert!(files.read(name).is_err(), "{name}");
        }
        let outside = files.read(&secret.display().to_string()).unwrap_err();
        assert!(outside.contains("outside"), "{outside}");
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(&secret, folder.path().join("src/arm/meshes/link.stl")).unwrap();
            assert!(files.read("package://arm/meshes/link.stl").unwrap_err().contains("outside"));
            std::os::unix::fs::symlink("a.stl", folder.path().join("src/arm/meshes/inner.stl")).unwrap();
            assert_eq!(files.read("package://arm/meshes/inner.stl").unwrap(), b"a");
        }
    }
}
