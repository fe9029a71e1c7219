//! Replay files.

use super::extract::Path;
use super::runs::may_replay;
use crate::http::state::AppState;
use axum::extract::State;
use axum::http::HeaderMap;
use axum::http::header::{CACHE_CONTROL, CONTENT_DISPOSITION, CONTENT_TYPE};
use axum::response::IntoResponse;
use palmares_net::transport::problem::Problem;
use palmares_protocol::Code;
use palmares_protocol::text::shortened;
use palmares_store::files::blocking::blocking;

/// The replay of a run.
pub(super) async fn replay(
    State(app): State<AppState>,
    Path(id): Path,
    headers: HeaderMap,
) -> Result<impl IntoResponse, Problem> {
    let none =
        |why: &str| Problem::new(Code::NotFound, format!("no replay of run `{}`: {why}", shortened(&id)));
    let run = app.store.run(&id).await?;
    let run = run.ok_or_else(|| none("there is no such run"))?;
    let identity = app.auth.identify(&app.store, &headers).await?;
    may_replay(&run, identity.as_ref(), &app)?;
    let stored = app.store.replay(&id).await?;
    let (stored, sha256) =
        stored.ok_or_else(|| none("it was not recorded, is not finished, or was deleted"))?;
    let archive = app.archive.as_ref().ok_or_else(|| none("this server does not record"))?;
    let (reader, digest) = (archive.clone(), sha256.clone());
    let bytes = match blocking(move || reader.read(&stored, &digest)).await {
        Ok(Ok(Some(bytes))) => bytes,
        Ok(Ok(None)) => return Err(none("its file is not on this server")),
        Ok(Err(error)) => {
            tracing::error!(%error, run = id, "a replay cannot be read");
            return Err(none("its file cannot be read"));
        }
        Err(error) => {
            tracing::error!(%error, run = id, "a replay cannot be read");
            return Err(Problem::new(Code::Internal, "the file could not be read"));
        }
    };
    let headers = [
        (CONTENT_TYPE, "application/octet-stream".to_owned()),
        (CONTENT_DISPOSITION, format!("attachment; filename=\"{}.mcap\"", run.run_id)),
        (CACHE_CONTROL, "no-store".to_owned()),
        (axum::http::HeaderName::from_static("x-sha256"), sha256),
    ];
    Ok((headers, bytes))
}
