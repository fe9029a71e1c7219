//! Memory, files, threads and tasks of this process, by the names that Prometheus' libraries give them.

use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::registry::{Registry, Unit};

/// The gauges of the process.
#[derive(Debug)]
pub(crate) struct ProcessMetrics {
    registry: Registry,
    resident_memory: Gauge,
    open_fds: Gauge,
    threads: Gauge,
    tasks: Gauge,
}

impl ProcessMetrics {
    pub(crate) fn new() -> Self {
        let mut metrics = ProcessMetrics {
            registry: Registry::with_prefix("process"),
            resident_memory: Gauge::default(),
            open_fds: Gauge::default(),
            threads: Gauge::default(),
            tasks: Gauge::default(),
        };
        let registry = &mut metrics.registry;
        if cfg!(target_os = "linux") {
            let help = "Memory of the process that is in RAM";
            registry.register_with_unit(
                "resident_memory",
                help,
                Unit::Bytes,
                metrics.resident_memory.clone(),
            );
            registry.register("open_fds", "Open files and sockets", metrics.open_fds.clone());
            registry.register("threads", "Threads", metrics.threads.clone());
        }
        registry.register("tasks", "Asynchronous tasks that have not ended", metrics.tasks.clone());
        metrics
    }

    /// The gauges as they are now. Outside of a runtime there are no tasks.
    pub(crate) fn read(&self) -> &Registry {
        if let Ok(runtime) = tokio::runtime::Handle::try_current() {
            self.tasks.set(i64::try_from(runtime.metrics().num_alive_tasks()).unwrap_or(i64::MAX));
        }
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let number = |name: &str| {
            let line = status.lines().find_map(|line| line.strip_prefix(name))?;
            line.split_whitespace().next()?.parse::<i64>().ok()
        };
        self.resident_memory.set(number("VmRSS:").map_or(0, |kib| kib * 1024));
        self.threads.set(number("Threads:").unwrap_or_default());
        // Without the one by which they are counted.
        let files = std::fs::read_dir("/proc/self/fd").map_or(0, |files| files.count().saturating_sub(1));
        self.open_fds.set(i64::try_from(files).unwrap_or(i64::MAX));
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
