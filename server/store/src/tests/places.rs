//! Databases for tests: an SQLite file, and Postgres where it is installed.

use super::postgres::postgres_database;
use crate::{Host, Location, Store};
use tempfile::TempDir;

/// An empty database.
pub(super) struct Place {
    location: Location,
    /// Removed in the end; a Postgres database ends with its server.
    _folder: Option<TempDir>,
}

impl Place {
    /// Opens the database.
    pub(super) async fn open(&self) -> Store {
        Store::open(&self.location, &Host::alone()).await.expect("opens")
    }

    /// Its location.
    pub(super) fn location(&self) -> &Location {
        &self.location
    }
}

/// An empty database of every kind on this machine.
pub(super) async fn places() -> Vec<Place> {
    let folder = tempfile::tempdir().expect("a folder");
    let location = Location::DataDir(folder.path().join("data"));
    let mut places = vec![Place { location, _folder: Some(folder) }];
    if let Some(url) = postgres_database().await {
        places.push(Place { location: Location::Url(url), _folder: None });
    }
    places
}
