//! How deep the stack of a program has been seen, kept in a file beside it for `cargo xtask size`.
//!
//! ```text
//! stack-depth     9ec53bd645ed60f66fa1b81241caaf25a1f9cb52 16072        the program's build id, bytes
//! ```

use std::io;
use std::path::Path;

use object::Object as _;

use crate::image::Image;

/// Stack that must never be used: the memory less this is the budget.
pub const RESERVE: u32 = 8 * 1024;
/// The file's name, which `xtask/src/size.rs` reads.
const FILE: &str = "stack-depth";

/// The greatest depth that was noted for a program, bytes; `None` if none was, or for another program.
fn noted(program: &Path) -> io::Result<Option<u32>> {
    let build = build_id(program)?;
    let text = std::fs::read_to_string(program.with_file_name(FILE)).unwrap_or_default();
    Ok(text.split_once(' ').filter(|(of, _)| *of == build).and_then(|(_, bytes)| bytes.trim().parse().ok()))
}

/// Notes a depth of the firmware's stack, unless a greater one is noted already.
///
/// # Errors
/// When the program cannot be read or the file not be written.
pub fn note(bytes: u32) -> io::Result<()> {
    let program = Image::usual_place();
    let most = noted(&program)?.unwrap_or(0).max(bytes);
    std::fs::write(program.with_file_name(FILE), format!("{} {most}\n", build_id(&program)?))
}

fn build_id(program: &Path) -> io::Result<String> {
    let bytes = std::fs::read(program)?;
    let file = object::File::parse(bytes.as_slice()).map_err(io::Error::other)?;
    let id = file.build_id().map_err(io::Error::other)?.unwrap_or_default();
    Ok(id.iter().map(|byte| format!("{byte:02x}")).collect())
}
