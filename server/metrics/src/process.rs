//! Memory, files, threads and tasks of this process, by the names that Prometheus' libraries give them.

use super::declare::{Number, metrics};
use prometheus_client::registry::Registry;

metrics! {
    /// The gauges of the process.
    pub(super) ProcessMetrics, "process":
    resident_memory: Number = "resident_memory" in Bytes only on "linux", "Memory of the process that is in RAM";
    open_fds: Number = "open_fds" only on "linux", "Open files and sockets";
    threads: Number = "threads" only on "linux", "Threads";
    tasks: Number = "tasks", "Asynchronous tasks that have not ended";
}

impl ProcessMetrics {
    pub(super) fn new() -> Self {
        Self::declared()
    }

    /// The gauges as they are now. Outside of a runtime there are no tasks.
    pub(super) fn read(&self) -> &Registry {
        if let Ok(runtime) = tokio::runtime::Handle::try_current() {
            self.tasks.set(runtime.metrics().num_alive_tasks() as u64);
        }
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let number = |name: &str| {
            let line = status.lines().find_map(|line| line.strip_prefix(name))?;
            line.split_whitespace().next()?.parse::<u64>().ok()
        };
        self.resident_memory.set(number("VmRSS:").map_or(0, |kib| kib * 1024));
        self.threads.set(number("Threads:").unwrap_or_default());
        // Without the one by which they are counted.
        let files = std::fs::read_dir("/proc/self/fd").map_or(0, |files| files.count().saturating_sub(1));
        self.open_fds.set(files as u64);
        &self.registry
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_file_and_a_task_are_counted_while_they_exist() {
        let metrics = ProcessMetrics::new();
        let read = || {
            metrics.read();
            (metrics.open_fds.get(), metrics.tasks.get())
        };
        // Other tests of this process open files of their own, so that only the tasks are exact.
        let before = read();
        assert!(before.0 > 0 && metrics.resident_memory.get() > 1 << 20 && metrics.threads.get() > 0);
        let task = tokio::spawn(std::future::pending::<()>());
        assert_eq!(read().1, before.1 + 1);
        task.abort();
        let _ = task.await;
        assert_eq!(read().1, before.1);
    }
}
