//! Addresses, each registered once with its handler and its description.

use super::operation::{Operation, Token};
use axum::Router;
use axum::handler::Handler;
use axum::routing;

/// A router and the descriptions of its addresses.
pub(in crate::http) struct Routes<S> {
    pub(in crate::http) router: Router<S>,
    pub(in crate::http) operations: Vec<Operation>,
    /// Token for operations that do not set one.
    token: Token,
}

impl<S: Clone + Send + Sync + 'static> Routes<S> {
    /// No addresses yet; `token` is the default.
    pub(in crate::http) fn of(token: Token) -> Self {
        Routes { router: Router::new(), operations: Vec::new(), token }
    }

    /// Adds an address and a method.
    pub(in crate::http) fn add<H: Handler<T, S>, T: 'static>(
        mut self,
        mut operation: Operation,
        handler: H,
    ) -> Self {
        let served = match operation.method {
            "post" => routing::post(handler),
            _ => routing::get(handler),
        };
        self.router = self.router.route(operation.path, served);
        if operation.token == Token::None {
            operation.token = self.token;
        }
        self.operations.push(operation);
        self
    }
}
