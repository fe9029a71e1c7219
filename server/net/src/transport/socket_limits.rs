//! Limits on open sockets: in total, and for each address.

use super::quota::{Quota, Quotas};
use super::trusted_proxies::TrustedProxies;
use std::net::IpAddr;
use std::sync::Arc;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// Sockets in addition to those of controllers: for viewers, and more than a hundred for single requests.
const OTHER_SOCKETS: usize = 512;

/// Counts the open sockets.
#[derive(Debug)]
pub struct SocketLimits {
    all: Arc<Semaphore>,
    by_address: Quotas<IpAddr>,
    per_address: usize,
    /// Sockets from these count towards the total only.
    pub(super) proxies: TrustedProxies,
}

/// A socket, counted until this is dropped.
#[derive(Debug)]
pub struct SocketPermit {
    _of_all: OwnedSemaphorePermit,
    _of_address: Option<Quota<IpAddr>>,
}

impl SocketLimits {
    /// Limits for this number of controllers, and of sockets from one address.
    pub fn new(controllers: usize, per_address: usize, proxies: TrustedProxies) -> Self {
        let all = Arc::new(Semaphore::new(controllers + OTHER_SOCKETS));
        SocketLimits { all, by_address: Quotas::default(), per_address, proxies }
    }

    /// Counts a socket from an address; None when a limit is reached. Sockets from this machine, where a proxy may run, and from
    /// trusted proxies count towards the total only.
    pub fn enter(&self, from: IpAddr) -> Option<SocketPermit> {
        let of_all = self.all.clone().try_acquire_owned().ok()?;
        let of_address = match self.proxies.contains(from) {
            true => None,
            false => self.of_address(from)?,
        };
        Some(SocketPermit { _of_all: of_all, _of_address: of_address })
    }

    /// Counts a socket towards those of its client's address; None when there are too many. Those of this machine have no limit.
    pub(super) fn of_address(&self, address: IpAddr) -> Option<Option<Quota<IpAddr>>> {
        let address = address.to_canonical();
        if address.is_loopback() {
            return Some(None);
        }
        let mut quota = self.by_address.of(address);
        quota.grow(1, self.per_address).then_some(Some(quota))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_has_a_quota_of_the_sockets_and_this_machine_has_none() {
        let proxy = "10.9.0.0/16".parse().expect("a range");
        let sockets = SocketLimits::new(1, 2, TrustedProxies(vec![proxy]));
        let far = IpAddr::from([10, 0, 0, 1]);
        let held = [sockets.enter(far), sockets.enter(far)];
        assert!(held.iter().all(Option::is_some));
        assert!(sockets.enter(far).is_none());
        let same = "::ffff:10.0.0.1".parse().expect("an address");
        assert!(sockets.enter(same).is_none(), "the same in another notation");
        assert!(sockets.enter(IpAddr::from([10, 0, 0, 2])).is_some());
        let near: Vec<_> = (0..9).map(|_| sockets.enter(IpAddr::from([127, 0, 0, 1]))).collect();
        assert!(near.iter().all(Option::is_some));
        let proxied: Vec<_> = (0..9).map(|_| sockets.enter(IpAddr::from([10, 9, 0, 1]))).collect();
        assert!(proxied.iter().all(Option::is_some));
        assert!(sockets.of_address(far).is_none(), "also through a proxy");
        drop(held);
        assert!(sockets.enter(far).is_some());
    }
}
