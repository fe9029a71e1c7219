//! Whether a connection's reader looks for bytes itself.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether whoever reads from a connection looks for bytes itself and need not be woken.
#[derive(Clone, Debug, Default)]
pub(super) struct Attention(Arc<AtomicBool>);

/// Whoever holds it polls until it drops it.
pub(super) struct Attentive<'a>(&'a AtomicBool);

impl Attention {
    /// From now on nobody is woken when bytes come.
    pub(super) fn attentive(&self) -> Attentive<'_> {
        self.0.store(true, Ordering::Release);
        Attentive(&self.0)
    }

    /// Whether nobody need be woken.
    pub(super) fn is_held(&self) -> bool {
        self.0.load(Ordering::Acquire)
    }
}

impl Drop for Attentive<'_> {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Release);
    }
}
