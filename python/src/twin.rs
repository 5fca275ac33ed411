//! The twin, step by step.

use crate::arrays::{list, rows};
use crate::failed;
use ::twin::control::Drive;
use ::twin::sim::{SimCell, SimState};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use numpy::{PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use shared_mem::cell::Cell;
use shared_mem::frames::Pose;
use shared_mem::msg::{Joints, joints_from};
use shared_mem::theta::Theta;
use std::path::PathBuf;

/// Joint arrays of a roll-out: q, dq [rows, joints], object position [rows, 3] and orientation [rows, 4], None without one.
type RolledOut = (Py<PyArray2<f64>>, Py<PyArray2<f64>>, Option<Py<PyArray2<f64>>>, Option<Py<PyArray2<f64>>>);

/// The simulated cell under its joint impedance controller, 1 ms a step.
#[pyclass(subclass, module = "twinalign._twinalign")]
pub(crate) struct Twin {
    cell: SimCell,
    begun: SimState,
    dof: usize,
}

#[pymethods]
impl Twin {
    /// The cell of a cell.toml; `theta`: what was identified, as JSON.
    #[new]
    #[pyo3(signature = (cell, theta=None))]
    fn new(cell: PathBuf, theta: Option<&str>) -> PyResult<Self> {
        let theta = theta.map(serde_json::from_str::<Theta>).transpose();
        let theta = theta.map_err(|error| PyValueError::new_err(format!("parameters: {error}")))?;
        let cell = SimCell::new(&Cell::read(&cell).map_err(failed)?, theta.as_ref()).map_err(failed)?;
        let dof = cell.arm_model().map_or(0, |arm| arm.dof());
        Ok(Self { begun: cell.state(), dof, cell })
    }

    /// Number of joints.
    #[getter]
    fn dof(&self) -> usize {
        self.dof
    }

    /// Puts everything back where cell.toml has it, or where it is given.
    #[pyo3(signature = (*, q=None, dq=None, object_position=None, object_orientation=None))]
    fn reset(
        &mut self,
        q: Option<PyReadonlyArray1<'_, f64>>,
        dq: Option<PyReadonlyArray1<'_, f64>>,
        object_position: Option<[f64; 3]>,
        object_orientation: Option<[f64; 4]>,
    ) -> PyResult<()> {
        self.cell.resume(&self.begun);
        if q.is_some() || dq.is_some() {
            let now = self.cell.joint_reading().q;
            let q = q.map_or(Ok(now), |q| self.joints(&q))?;
            let dq = dq.map_or(Ok([0.0; 8]), |dq| self.joints(&dq))?;
            self.cell.set_arm(&q[..self.dof], &dq[..self.dof]);
        }
        if object_position.is_some() || object_orientation.is_some() {
            let Some(now) = self.cell.object() else { return Err(PyValueError::new_err("cell.toml has no object")) };
            let [x, y, z] = object_position.unwrap_or_else(|| now.position().into());
            let [w, i, j, k] = object_orientation.unwrap_or_else(|| now.wxyz());
            let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
            let pose = Pose::from_isometry(Isometry3::from_parts(Translation3::new(x, y, z), turn));
            self.cell.set_object(&pose, Vector3::zeros(), Vector3::zeros());
        }
        Ok(())
    }

    /// Lets `periods` control periods of 1 ms pass under desired positions and velocities.
    #[pyo3(signature = (q_d, dq_d=None, periods=1))]
    fn step(
        &mut self,
        q_d: PyReadonlyArray1<'_, f64>,
        dq_d: Option<PyReadonlyArray1<'_, f64>>,
        periods: usize,
    ) -> PyResult<()> {
        let q_d = self.joints(&q_d)?;
        let dq_d = dq_d.map_or(Ok([0.0; 8]), |dq_d| self.joints(&dq_d))?;
        let drive = Drive::JointImpedance { q_d, dq_d };
        (0..periods).for_each(|_| self.cell.step(&drive));
        Ok(())
    }

    /// Plays a series of commands, one a control period; states at the end of each.
    fn roll_out(
        &mut self,
        py: Python<'_>,
        q_d: PyReadonlyArray2<'_, f64>,
        dq_d: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<RolledOut> {
        let dof = self.dof;
        let (told, turning) = (q_d.as_array(), dq_d.as_array());
        if told.shape() != turning.shape() || told.ncols() != dof {
            return Err(PyValueError::new_err(format!("q_d and dq_d have to be of one shape, [rows, {dof}]")));
        }
        let (told, turning): (Vec<f64>, Vec<f64>) = (told.iter().copied().collect(), turning.iter().copied().collect());
        let cell = &mut self.cell;
        let (mut q, mut dq, mut place, mut turn) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        py.detach(|| {
            for (q_d, dq_d) in told.chunks(dof).zip(turning.chunks(dof)) {
                cell.step(&Drive::JointImpedance { q_d: joints_from(q_d), dq_d: joints_from(dq_d) });
                let state = cell.joint_reading();
                q.extend_from_slice(&state.q[..dof]);
                dq.extend_from_slice(&state.dq[..dof]);
                if let Some(pose) = cell.object() {
                    place.extend(pose.position());
                    turn.extend(pose.wxyz());
                }
            }
        });
        let none = || PyValueError::new_err("there are no commands");
        let q = rows(py, q, dof)?.ok_or_else(none)?;
        let dq = rows(py, dq, dof)?.ok_or_else(none)?;
        Ok((q, dq, rows(py, place, 3)?, rows(py, turn, 4)?))
    }

    /// Simulated time since the last reset, s.
    #[getter]
    fn time(&self) -> f64 {
        self.cell.time_ns() as f64 * 1e-9
    }

    /// What the encoders read [joints], rad.
    #[getter]
    fn q(&self, py: Python<'_>) -> Py<PyArray1<f64>> {
        self.array(py, &self.cell.joint_reading().q)
    }

    /// The same as velocities [joints], rad/s.
    #[getter]
    fn dq(&self, py: Python<'_>) -> Py<PyArray1<f64>> {
        self.array(py, &self.cell.joint_reading().dq)
    }

    /// Torques behind the gears, gravity included, mean over the last period [joints], N m.
    #[getter(tau_J)]
    fn tau(&self, py: Python<'_>) -> Py<PyArray1<f64>> {
        self.array(py, &self.cell.reading().tau_J)
    }

    /// Torques asked for in the last period, without gravity [joints], N m.
    #[getter(tau_J_d)]
    fn tau_d(&self, py: Python<'_>) -> Py<PyArray1<f64>> {
        self.array(py, &self.cell.reading().tau_J_d)
    }

    /// Geometric centre of the object in the base frame [3], m; None without one.
    #[getter]
    fn object_position(&self, py: Python<'_>) -> Option<Py<PyArray1<f64>>> {
        self.cell.object().map(|pose| list(py, pose.position().to_vec()))
    }

    /// The object's quaternion w, x, y, z in the base frame [4]; None without one.
    #[getter]
    fn object_orientation(&self, py: Python<'_>) -> Option<Py<PyArray1<f64>>> {
        self.cell.object().map(|pose| list(py, pose.wxyz().to_vec()))
    }

    /// Force between tool and object, N.
    #[getter]
    fn contact_force(&self) -> f64 {
        self.cell.contact_force()
    }
}

impl Twin {
    fn joints(&self, given: &PyReadonlyArray1<'_, f64>) -> PyResult<Joints> {
        let view = given.as_array();
        if view.len() != self.dof {
            return Err(PyValueError::new_err(format!("{} numbers for {} joints", view.len(), self.dof)));
        }
        let mut joints = [0.0; 8];
        joints.iter_mut().zip(view).for_each(|(joint, value)| *joint = *value);
        Ok(joints)
    }

    fn array(&self, py: Python<'_>, joints: &Joints) -> Py<PyArray1<f64>> {
        list(py, joints[..self.dof].to_vec())
    }
}
