//! Limits on open sockets: in total, and for each address.

use super::quota::{Quota, Quotas};
use std::net::IpAddr;
use std::sync::Arc;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// Sockets in addition to those of controllers: for viewers and single requests.
const OTHER_SOCKETS: usize = 512;

/// Counts the open sockets.
#[derive(Debug)]
pub(crate) struct SocketLimits {
    all: Arc<Semaphore>,
    by_address: Quotas<IpAddr>,
    per_address: usize,
}

/// A socket, counted until this is dropped.
#[derive(Debug)]
pub(crate) struct SocketPermit {
    _of_all: OwnedSemaphorePermit,
    _of_address: Option<Quota<IpAddr>>,
}

impl SocketLimits {
    /// Limits for this number of controllers, and of sockets from one address.
    pub(crate) fn new(controllers: usize, per_address: usize) -> Self {
        let all = Arc::new(Semaphore::new(controllers + OTHER_SOCKETS));
        SocketLimits { all, by_address: Quotas::default(), per_address }
    }

    /// Counts a socket from an address; None when a limit is reached. Sockets from this machine, where a proxy may run, count
    /// towards the total only.
    pub(crate) fn enter(&self, from: IpAddr) -> Option<SocketPermit> {
        let of_all = self.all.clone().try_acquire_owned().ok()?;
        let address = from.to_canonical();
        let of_address = match Some(address).filter(|address| !address.is_loopback()) {
            Some(address) => {
                let mut quota = self.by_address.of(address);
                quota.grow(1, self.per_address).then_some(Some(quota))?
            }
            None => None,
        };
        Some(SocketPermit { _of_all: of_all, _of_address: of_address })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_has_a_quota_of_the_sockets_and_this_machine_has_none() {
        let sockets = SocketLimits::new(1, 2);
        let far = IpAddr::from([10, 0, 0, 1]);
        let held = [sockets.enter(far), sockets.enter(far)];
        assert!(held.iter().all(Option::is_some));
        assert!(sockets.enter(far).is_none());
        let same = "::ffff:10.0.0.1".parse().expect("an address");
        assert!(sockets.enter(same).is_none(), "the same in another notation");
        assert!(sockets.enter(IpAddr::from([10, 0, 0, 2])).is_some());
        let near: Vec<_> = (0..9).map(|_| sockets.enter(IpAddr::from([127, 0, 0, 1]))).collect();
        assert!(near.iter().all(Option::is_some));
        drop(held);
        assert!(sockets.enter(far).is_some());
    }
}
