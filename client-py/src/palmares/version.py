"""The version of this package, which `hello` sends to the server. That of the workspace's Cargo.toml."""

VERSION = "0.2.0"
