//! A task in which whoever has a policy acts, row by row of ten milliseconds.

use crate::arrays::list;
use crate::failed;
use ::twin::task::{Acting, ActingEnd, Numbers, ROWS_A_SECOND, Signs, Task, TaskView};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods as _, PyReadonlyArray1};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use shared_mem::cell::Cell;
use shared_mem::theta::Theta;
use std::path::PathBuf;
use std::sync::Arc;

/// Colour [rows, columns, 3] and depth [rows, columns] of a picture.
type Picture = (Py<PyArray3<u8>>, Py<PyArray2<u16>>);

/// A task, and the episode of it that is in progress.
#[pyclass(subclass, unsendable, module = "twinalign._twinalign")]
pub(crate) struct TaskEpisode {
    task: Arc<Task>,
    numbers: Numbers,
    views: Vec<TaskView>,
    acting: Option<Acting>,
    signs: Signs,
}

#[pymethods]
impl TaskEpisode {
    /// The task of a task file; `cell`: the cell whose arm carries it out, `theta`: what was identified of it, as JSON.
    #[new]
    #[pyo3(signature = (task, cell=None, theta=None))]
    fn new(task: PathBuf, cell: Option<PathBuf>, theta: Option<&str>) -> PyResult<Self> {
        let task = Task::read(&task).map_err(failed)?;
        let theta = theta.map(serde_json::from_str::<Theta>).transpose();
        let theta = theta.map_err(|error| PyValueError::new_err(format!("parameters: {error}")))?;
        let task = match cell {
            Some(cell) => task.in_cell(&Cell::read(&cell).map_err(failed)?, theta.as_ref()).map_err(failed)?.0,
            None if theta.is_some() => {
                return Err(PyValueError::new_err("parameters are those of a cell; give cell as well"));
            }
            None => task,
        };
        let views = task.cameras().iter().map(|camera| task.view(camera)).collect();
        Ok(Self { numbers: Numbers::of(&task), views, task: Arc::new(task), acting: None, signs: Signs::default() })
    }

    /// What is to be done, in words.
    #[getter]
    fn instruction(&self) -> &str {
        self.task.instruction()
    }

    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        self.task.name()
    }

    /// How long an episode takes at most, s.
    #[getter]
    fn horizon(&self) -> f64 {
        self.task.horizon()
    }

    /// Rows a second: the most actions a second there can be.
    #[getter]
    fn rows_a_second(&self) -> u32 {
        ROWS_A_SECOND
    }

    /// Names of the state's numbers, and of an action's.
    #[getter]
    fn state_names(&self) -> Vec<String> {
        self.numbers.state_names()
    }

    /// Names of the surroundings' numbers.
    #[getter]
    fn surroundings_names(&self) -> Vec<String> {
        self.numbers.surroundings_names()
    }

    /// Name, rows, columns and focal length [pixel] of each camera.
    #[getter]
    fn cameras(&self) -> Vec<(String, u32, u32, f64)> {
        let of = self.task.cameras().iter();
        of.map(|camera| (camera.name.clone(), camera.size[1], camera.size[0], camera.focal)).collect()
    }

    /// Begins an episode: bodies where the seed has them start.
    fn reset(&mut self, seed: u64) -> PyResult<()> {
        self.signs = Signs::default();
        self.acting = Some(Acting::begin(&self.task, seed).map_err(failed)?);
        Ok(())
    }

    /// Goes for an action over so many rows: success, progress, whether it is over, time [s], what would have stopped a robot.
    fn step(
        &mut self,
        action: PyReadonlyArray1<'_, f32>,
        rows: usize,
    ) -> PyResult<(bool, f64, bool, f64, Option<String>)> {
        let values: Vec<f32> = action.as_array().iter().copied().collect();
        let acting = self.acting.as_mut().ok_or_else(begin_first)?;
        let action = self.numbers.read(&values).map_err(PyValueError::new_err)?;
        acting.act(&action, rows);
        let ActingEnd { success, progress, duration_s, fault, .. } = acting.end();
        Ok((success, progress, acting.is_over(), duration_s, fault))
    }

    /// Moved bodies, gripper, driven joints, arm, in the order of `state_names`.
    fn state(&mut self, py: Python<'_>) -> PyResult<Py<PyArray1<f32>>> {
        let now = self.acting.as_ref().and_then(Acting::now).ok_or_else(begin_first)?;
        Ok(list(py, self.numbers.state(now, &mut self.signs)))
    }

    /// Free bodies and joints without a drive, in the order of `surroundings_names`.
    fn surroundings(&mut self, py: Python<'_>) -> PyResult<Py<PyArray1<f32>>> {
        let now = self.acting.as_ref().and_then(Acting::now).ok_or_else(begin_first)?;
        Ok(list(py, self.numbers.surroundings(now, &mut self.signs)))
    }

    /// What the cameras show, as late as those of the cell: colour [rows, columns, 3] and depth [rows, columns] mm of each.
    fn pictures(&mut self, py: Python<'_>) -> PyResult<Vec<Picture>> {
        let shown = self.acting.as_ref().and_then(Acting::seen).ok_or_else(begin_first)?;
        let joints = shown.arm.as_ref().map(|arm| &arm.q);
        let mut pictures = Vec::new();
        for (view, camera) in self.views.iter_mut().zip(self.task.cameras()) {
            let [columns, rows] = camera.size.map(|pixels| pixels as usize);
            let picture = view.draw(&shown.poses, joints);
            let colour = PyArray1::from_vec(py, picture.colour).reshape([rows, columns, 3])?.unbind();
            pictures.push((colour, PyArray1::from_vec(py, picture.depth).reshape([rows, columns])?.unbind()));
        }
        Ok(pictures)
    }
}

fn begin_first() -> PyErr {
    PyRuntimeError::new_err("no episode has begun; call reset first")
}
