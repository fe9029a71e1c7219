//! Messages of the protocol as Python gets them: bytes of MessagePack.

use palmares_protocol::encoding::Payload;
use palmares_protocol::{Encoding, Refusal, Reply};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

/// Room for a message, bytes.
const ROOM: usize = 8192;

/// A reply, or the message of a refusal.
pub(crate) fn of<'py>(
    py: Python<'py>,
    id: u64,
    reply: Result<Reply, Refusal>,
) -> PyResult<Bound<'py, PyBytes>> {
    let reply = reply.unwrap_or_else(|refusal| Reply::refused(Some(id), &refusal));
    match Encoding::MsgPack.write(&reply, ROOM) {
        Ok(Payload::Binary(bytes)) => Ok(PyBytes::new(py, &bytes)),
        Ok(Payload::Text(_)) => Err(PyRuntimeError::new_err("MessagePack is binary")),
        Err(error) => Err(PyRuntimeError::new_err(error.to_string())),
    }
}
