//! A socket for clients on the same machine, where the system offers one: through it a message takes a fraction of what
//! it takes through the loopback interface. Its name is drawn at random and told only in the answer to a handshake that
//! came over that interface, so that no other program can take it in advance.

use std::io;
use std::sync::Arc;
use tokio::net::UnixListener;

/// Listens for clients on the same machine.
#[derive(Debug)]
pub(super) struct Local {
    pub(super) name: Arc<str>,
    pub(super) listener: UnixListener,
}

impl Local {
    /// Opens the socket: a name in Linux's abstract namespace, which needs no file and ends with the program.
    #[cfg(target_os = "linux")]
    pub(super) fn open() -> io::Result<Self> {
        use std::os::linux::net::SocketAddrExt;
        use std::os::unix::net::{SocketAddr, UnixListener as Listener};
        let random = crate::auth::random_hex(16).map_err(io::Error::other)?;
        let name = format!("palmares-{random}");
        let listener = Listener::bind_addr(&SocketAddr::from_abstract_name(&name)?)?;
        listener.set_nonblocking(true)?;
        Ok(Local { name: name.into(), listener: UnixListener::from_std(listener)? })
    }

    /// There is none.
    #[cfg(not(target_os = "linux"))]
    pub(super) fn open() -> io::Result<Self> {
        Err(io::ErrorKind::Unsupported.into())
    }
}
