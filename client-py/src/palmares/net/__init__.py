"""The connection to a server: messages in and out, over WebSocket and HTTP."""
