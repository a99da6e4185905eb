//! A multicast group of this process's own: the same tests may run in another folder at the same time.

/// An IPv4 group, administratively scoped.
#[must_use]
pub fn group() -> String {
    let [_, _, high, low] = std::process::id().to_be_bytes();
    format!("239.75.{high}.{low}")
}
