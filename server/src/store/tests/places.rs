//! Databases for tests: an SQLite file, and Postgres where it is installed.

use super::postgres::postgres_database;
use crate::store::{Location, Store};
use std::path::PathBuf;

/// An empty database.
pub(crate) struct Place {
    location: Location,
    /// Removed in the end; a Postgres database goes with its server.
    folder: Option<PathBuf>,
}

impl Place {
    /// Opens the database.
    pub(crate) async fn open(&self) -> Store {
        Store::open(&self.location).await.expect("opens")
    }

    /// Where it is.
    pub(crate) fn location(&self) -> &Location {
        &self.location
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        if let Some(folder) = &self.folder {
            let _ = std::fs::remove_dir_all(folder);
        }
    }
}

/// An empty database of every kind there is on this machine.
pub(crate) async fn places() -> Vec<Place> {
    let name = crate::auth::random_hex(8).expect("randomness");
    let folder = std::env::temp_dir().join(format!("palmares-store-{name}"));
    let mut places = vec![Place { location: Location::DataDir(folder.clone()), folder: Some(folder) }];
    if let Some(url) = postgres_database().await {
        places.push(Place { location: Location::Url(url), folder: None });
    }
    places
}
