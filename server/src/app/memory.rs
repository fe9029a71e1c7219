//! The memory of a server that runs for a long time.

/// Arenas of glibc's allocator for all threads together.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const ARENAS: libc::c_int = 2;

/// Lets all threads share two arenas. By default glibc opens eight a core, and each keeps the most memory that any world which
/// was ever computed in it has needed: under load a server then grew by a tenth in an hour, to 78 MB. With two it took 58 MB after
/// five minutes and 60 MB after 38. Call it before the first thread starts.
pub(super) fn limit_arenas() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        // SAFETY: mallopt reads its two numbers and writes the allocator's own settings; no other thread runs yet.
        #[expect(unsafe_code, reason = "the setting has no safe interface")]
        let accepted = unsafe { libc::mallopt(libc::M_ARENA_MAX, ARENAS) };
        debug_assert_eq!(accepted, 1);
    }
}
