//! Warnings and errors about one file. Both name the file and the element in it.

use std::cell::RefCell;
use std::path::{Path, PathBuf};

use crate::error::{LoadWarning, ModelError, Refused};

/// Number of errors that are kept of one file; more help nobody.
const MAX_ERRORS: usize = 100;

/// Collects the warnings and errors about one file and builds the errors that name it.
pub(crate) struct Report {
    pub(crate) file: PathBuf,
    pub(crate) warnings: Vec<LoadWarning>,
    /// Errors after which reading goes on, to find further ones.
    errors: RefCell<Vec<ModelError>>,
}

impl Report {
    /// A report on a file without warnings.
    pub(crate) fn new(file: &Path) -> Report {
        Report { file: file.to_owned(), warnings: Vec::new(), errors: RefCell::default() }
    }

    /// Keeps an error, so that reading can go on: the file is refused in the end.
    pub(crate) fn keep<T>(&self, result: Result<T, ModelError>) -> Option<T> {
        match result {
            Ok(value) => Some(value),
            Err(error) => {
                let mut errors = self.errors.borrow_mut();
                if errors.len() < MAX_ERRORS {
                    errors.push(error);
                }
                None
            }
        }
    }

    /// Number of kept errors.
    pub(crate) fn kept(&self) -> usize {
        self.errors.borrow().len()
    }

    /// The kept errors as one.
    pub(crate) fn refusal(&self) -> ModelError {
        Refused { errors: self.take_errors(), warnings: Vec::new() }.into_error()
    }

    /// Takes the kept errors out of the report.
    pub(crate) fn take_errors(&self) -> Vec<ModelError> {
        self.errors.take()
    }

    pub(crate) fn warn(&mut self, element: impl Into<String>, message: impl Into<String>) {
        let (element, message) = (element.into(), message.into());
        self.warnings.push(LoadWarning { file: self.file.clone(), element, message });
    }

    /// The error about an invalid element.
    pub(crate) fn bad(
        &self,
        element: impl Into<String>,
        problem: impl Into<String>,
        valid: impl Into<String>,
    ) -> ModelError {
        let (element, problem, valid) = (element.into(), problem.into(), valid.into());
        ModelError::Element { file: self.file.clone(), element, problem, valid }
    }

    /// The error about a file that is not well-formed.
    pub(crate) fn syntax(&self, format: &'static str, error: impl ToString) -> ModelError {
        ModelError::Syntax { file: self.file.clone(), format, message: error.to_string() }
    }

    /// The error about a count above its limit.
    pub(crate) fn too_large(
        &self,
        element: impl Into<String>,
        what: &'static str,
        found: u64,
        limit: u64,
    ) -> ModelError {
        let (file, element) = (self.file.clone(), element.into());
        ModelError::TooLarge { file, element, what, found, limit }
    }

    /// Rejects more than `limit` of something.
    pub(crate) fn limit(
        &self,
        element: impl Into<String>,
        what: &'static str,
        found: impl TryInto<u64>,
        limit: impl TryInto<u64>,
    ) -> Result<(), ModelError> {
        let found = found.try_into().unwrap_or(u64::MAX);
        let limit = limit.try_into().unwrap_or(u64::MAX);
        if found <= limit { Ok(()) } else { Err(self.too_large(element, what, found, limit)) }
    }

    /// Rejects a number that is not finite or larger than `limit`.
    pub(crate) fn number(
        &self,
        element: impl FnOnce() -> String,
        what: &str,
        value: f64,
        limit: f64,
    ) -> Result<(), ModelError> {
        if value.abs() <= limit {
            return Ok(());
        }
        let valid = format!("finite numbers of at most {limit:e}");
        Err(self.bad(element(), format!("has {what} {value:e}"), valid))
    }
}
