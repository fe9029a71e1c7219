//! The server, for the commands that need it. A build without the feature `server` has the same commands and refuses them.

use clap::ValueEnum;

/// A description that `palmares schema` prints.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Description {
    /// The messages of the control socket, as JSON Schema
    Control,
    /// The messages of the watch socket, as JSON Schema
    Watch,
    /// The HTTP addresses, as OpenAPI 3.1
    Openapi,
    /// The messages of a replay: JSON Schema, and the fields of the protobuf messages
    Replay,
}

#[cfg(feature = "server")]
pub(crate) use linked::*;
#[cfg(not(feature = "server"))]
pub(crate) use missing::*;

#[cfg(feature = "server")]
mod linked {
    use super::Description;
    use palmares_server::schema;
    use serde_json::Value;

    pub(crate) use palmares_server::{ServeOptions, hand_limits, new_keys, restore};

    pub(crate) fn serve(options: &ServeOptions) -> anyhow::Result<std::process::ExitCode> {
        palmares_server::serve(options, crate::version::version())
    }

    pub(crate) fn schema(description: Description) -> anyhow::Result<Value> {
        Ok(match description {
            Description::Control => schema::control(),
            Description::Watch => schema::watch(),
            Description::Openapi => schema::openapi(),
            Description::Replay => palmares_replay::schema::document(),
        })
    }
}

#[cfg(not(feature = "server"))]
mod missing {
    use super::Description;
    use clap::Args;
    use palmares_models::measure::HandLimits;
    use serde_json::Value;
    use std::ffi::OsString;
    use std::path::Path;
    use std::process::ExitCode;

    /// Takes every argument, so that `serve` answers with its reason and not with a refused option.
    #[derive(Args, Debug)]
    pub(crate) struct ServeOptions {
        #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
        arguments: Vec<OsString>,
    }

    fn refused(command: &str) -> anyhow::Error {
        anyhow::anyhow!(
            "this build has no server, which `{command}` needs: the server runs on Linux and macOS. On Windows, use WSL \
             or the container (`docker compose up --build`). Worlds in this process (palmares.sim, Client(\"local\")) and \
             clients of a server elsewhere need none"
        )
    }

    pub(crate) fn serve(_: &ServeOptions) -> anyhow::Result<ExitCode> {
        Err(refused("palmares serve"))
    }

    pub(crate) fn new_keys(_: &Path, _: Option<u32>) -> anyhow::Result<Value> {
        Err(refused("palmares keys"))
    }

    pub(crate) fn restore(_: &Path, _: &Path, _: Option<&str>, _: bool) -> anyhow::Result<Vec<String>> {
        Err(refused("palmares admin restore"))
    }

    pub(crate) fn hand_limits(_: &Path) -> anyhow::Result<HandLimits> {
        Err(refused("palmares hand check --config"))
    }

    pub(crate) fn schema(_: Description) -> anyhow::Result<Value> {
        Err(refused("palmares schema"))
    }
}
