//! Points of a sweep in other processes, by an executor of Python.

use crate::errors::Raised;
use crate::waiting::interruptible;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::time::Duration;
use stickslip::sweep::{Executor, evaluate as evaluated};

/// `stickslip._executor.Tasks`.
#[derive(Debug)]
pub struct Tasks(pub Py<PyAny>);

impl Executor for Tasks {
    fn submit(&mut self, study: &str, points: &str) -> Result<(), String> {
        let submitted = Python::attach(|py| self.0.call_method1(py, "submit", (study, points)).map(drop));
        submitted.map_err(|error| error.to_string())
    }

    fn finished(&mut self, wait: Duration) -> Result<Option<Vec<u8>>, String> {
        let finished = Python::attach(|py| {
            let result = self.0.call_method1(py, "finished", (wait.as_secs_f64(),))?;
            result.extract::<Option<Vec<u8>>>(py)
        });
        finished.map_err(|error| error.to_string())
    }

    fn cancel(&mut self) {
        // The sweep ends anyway, and says why.
        let _ = Python::attach(|py| self.0.call_method0(py, "cancel").map(drop));
    }
}

/// Runs the points of a task, in a worker: what `stickslip.sweep` sends to it.
#[pyfunction]
pub fn evaluate<'py>(py: Python<'py>, study: &str, points: &str) -> PyResult<Bound<'py, PyBytes>> {
    match interruptible(py, None, |watch| evaluated(study, points, &*watch.stop))? {
        Ok(Some(outcomes)) => Ok(PyBytes::new(py, &outcomes)),
        Ok(None) => Err(Raised("RunError", "the task was stopped".to_owned()).into()),
        Err(message) => Err(Raised("RunError", message).into()),
    }
}
