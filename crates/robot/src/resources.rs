//! Mesh files of a robot description, found and read by the caller.

/// Mesh files by their names in a description. This crate opens no files: a program finds them, within the folders that its user names.
pub trait Resources {
    /// Reads a mesh file; `name` is the attribute `filename` of a `mesh` element, such as `package://my_arm/meshes/base.stl`.
    ///
    /// # Errors
    /// A line without the name: there is no such file, it may not be read, or it is too large.
    fn read(&mut self, name: &str) -> Result<Vec<u8>, String>;

    /// Finds a mesh file that is not read, since it is for looks only.
    ///
    /// # Errors
    /// A line without the name: there is no such file, or it may not be read.
    fn find(&mut self, name: &str) -> Result<(), String>;
}

/// No mesh files: a description that has collision meshes is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoMeshes;

impl Resources for NoMeshes {
    fn read(&mut self, _: &str) -> Result<Vec<u8>, String> {
        Err("no mesh files are read here".to_owned())
    }

    fn find(&mut self, _: &str) -> Result<(), String> {
        Ok(())
    }
}
