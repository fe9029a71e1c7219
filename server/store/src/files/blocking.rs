//! Work that blocks its thread: files, hashes of large data, large JSON. It must not run on the threads of the network, where it would
//! delay every connection.

use std::cell::Cell;
use tokio::runtime::Handle;

thread_local! {
    static MAY_BLOCK: Cell<bool> = const { Cell::new(false) };
}

/// Runs blocking work on a thread of its own.
///
/// # Errors
/// The work panicked, or the runtime stops.
pub async fn blocking<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> std::io::Result<T> {
    let work = move || {
        MAY_BLOCK.set(true);
        let result = work();
        MAY_BLOCK.set(false);
        result
    };
    tokio::task::spawn_blocking(work).await.map_err(std::io::Error::other)
}

/// Panics in debug builds on a thread of the network. Every function that blocks calls it, so that tests find wrong callers.
pub fn assert_may_block() {
    debug_assert!(
        MAY_BLOCK.get() || Handle::try_current().is_err(),
        "blocking work on a thread of the network"
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn blocking_work_is_found_on_a_thread_of_the_network_only() {
        let on_network = tokio::spawn(async { assert_may_block() }).await;
        assert_eq!(on_network.is_err(), cfg!(debug_assertions));
        blocking(assert_may_block).await.expect("a thread for blocking work");
        std::thread::spawn(assert_may_block).join().expect("a thread outside the runtime");
    }
}
