//! The operations by which the store changes a disk. Tests make each of them fail (`faults`).

use std::ffi::{OsStr, OsString};
use std::fs;
use std::io::{self, Write};
use std::path::Path;

use tempfile::NamedTempFile;

#[cfg(any(test, feature = "faults"))]
use crate::faults::{self, Operation};

/// Prefix of the names of half-written files.
const HALF_WRITTEN: &str = ".writing-";
/// Random letters and digits at the end of such a name.
const RANDOM: usize = 6;
/// Longest final name that is part of such a name \[bytes\], our own choice: file systems allow 255 for both together.
const LONGEST_NAME: usize = 200;

/// True if a name is that of a half-written file.
pub(crate) fn is_half_written(name: &OsStr) -> bool {
    name.to_string_lossy().starts_with(HALF_WRITTEN)
}

/// Beginning of the names of half-written files of a path.
fn prefix_of(path: &Path) -> OsString {
    let mut prefix = OsString::from(HALF_WRITTEN);
    if let Some(name) = path.file_name().filter(|name| name.len() <= LONGEST_NAME) {
        prefix.push(name);
        prefix.push("-");
    }
    prefix
}

/// True if a name is that of a half-written file of a path.
pub(crate) fn is_half_written_of(name: &OsStr, path: &Path) -> bool {
    let random = name.as_encoded_bytes().strip_prefix(prefix_of(path).as_encoded_bytes());
    random.is_some_and(|random| random.len() == RANDOM && random.iter().all(u8::is_ascii_alphanumeric))
}

/// Folder that a file is in.
pub(crate) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Makes a folder, if there is none, in one that exists.
pub(crate) fn create_folder(path: &Path) -> io::Result<()> {
    #[cfg(any(test, feature = "faults"))]
    faults::before(path, Operation::CreateFolder)?;
    match fs::create_dir(path) {
        Err(e) if e.kind() != io::ErrorKind::AlreadyExists => Err(e),
        _ => Ok(()),
    }
}

/// Makes a folder and all that it is in.
pub(crate) fn create_folders(path: &Path) -> io::Result<()> {
    #[cfg(any(test, feature = "faults"))]
    faults::before(path, Operation::CreateFolder)?;
    fs::create_dir_all(path)
}

/// Begins a file in the folder of a path, whose name it will take later. Dropped before, it is gone. A device, pipe or socket of that name is refused, because a file would take its
/// place: `--out /dev/null` of an administrator would end the machine's null device.
pub(crate) fn begin(path: &Path) -> io::Result<NamedTempFile> {
    if fs::metadata(path).is_ok_and(|there| !there.is_file() && !there.is_dir()) {
        let problem = "it is a device, a pipe or a socket, which a file would replace; give a file";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, problem));
    }
    let folder = folder_of(path);
    #[cfg(any(test, feature = "faults"))]
    faults::before(folder, Operation::Begin)?;
    let prefix = prefix_of(path);
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).rand_bytes(RANDOM);
    // Results are for everyone that the umask lets read; temporary files are private by default.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder)
}

/// Writes the bytes of a file.
pub(crate) fn write(file: &mut NamedTempFile, bytes: &[u8]) -> io::Result<()> {
    #[cfg(any(test, feature = "faults"))]
    if let Err(e) = faults::before(file.path(), Operation::Write) {
        faults::leave_half(file, bytes);
        return Err(e);
    }
    file.write_all(bytes)
}

/// Gives a file its name, after all its bytes are on the disk. A file that has the name is replaced.
pub(crate) fn finish(mut file: NamedTempFile, path: &Path) -> io::Result<()> {
    #[cfg(any(test, feature = "faults"))]
    if let Err(e) = faults::before(path, Operation::Rename) {
        faults::leave_half(&mut file, &[]);
        return Err(e);
    }
    file.as_file_mut().flush()?;
    // Sweeps over all faults write thousands of files that need not outlive the power.
    #[cfg(any(test, feature = "faults"))]
    if faults::is_watched(path) {
        return file.persist(path).map(drop).map_err(|e| e.error);
    }
    file.as_file().sync_all()?;
    file.persist(path).map(drop).map_err(|e| e.error)
}

/// Removes a file, if there is one.
pub(crate) fn remove(path: &Path) -> io::Result<()> {
    #[cfg(any(test, feature = "faults"))]
    faults::before(path, Operation::Remove)?;
    match fs::remove_file(path) {
        Err(e) if e.kind() != io::ErrorKind::NotFound => Err(e),
        _ => Ok(()),
    }
}
