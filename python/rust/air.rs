//! The air below one hovering drone, and what another makes of it.

use airflow::separation;
use airflow::{Airframe, Jet, Source, Superposition, Wake, mean_over_discs_mps};
use nalgebra::{Point3, Vector3};
use numpy::ndarray::{Array1, Array2, ArrayView1};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// The wake of one hovering drone, and its rotor discs.
#[pyclass(frozen)]
pub(crate) struct Air {
    airframe: Airframe,
    mass_kg: f64,
    wake: Wake,
    density_kg_per_m3: f64,
}

/// An airframe's numbers: mass (kg), propellers, their diameter (m), motor distance (m), width
/// factor.
type Numbers = (f64, u32, f64, f64, f64);

#[pymethods]
impl Air {
    #[new]
    fn new(
        name: &str,
        numbers: Option<Numbers>,
        mass_kg: Option<f64>,
        outside: (f64, f64),
    ) -> PyResult<Air> {
        let (temperature_c, pressure_pa) = outside;
        let airframe = match numbers {
            Some((mass_kg, propellers, diameter_m, motors_m, width)) => {
                let new = Airframe::new(name, mass_kg, propellers, diameter_m, motors_m, width);
                new.map_err(|error| PyValueError::new_err(format!("`{name}`: {error}")))?
            }
            None => {
                Airframe::named(name).map_err(|error| PyValueError::new_err(error.to_string()))?
            }
        };
        let air = airflow::Air {
            temperature_c,
            pressure_pa,
        };
        if let Some(problem) = air.problems().first() {
            return Err(PyValueError::new_err(problem.to_string()));
        }
        let mass_kg = mass_kg.unwrap_or(airframe.mass_kg());
        if !(mass_kg.is_finite() && mass_kg > 0.0) {
            let told = format!("mass_kg is {mass_kg} kg; it must be finite and above 0");
            return Err(PyValueError::new_err(told));
        }
        let density_kg_per_m3 = air.density_kg_per_m3();
        Ok(Air {
            wake: Wake::new(&airframe, mass_kg, density_kg_per_m3, &Jet::default()),
            density_kg_per_m3,
            airframe,
            mass_kg,
        })
    }

    #[getter]
    fn hover_velocity_mps(&self) -> f64 {
        self.wake.hover_velocity_mps()
    }

    #[getter]
    fn density_kg_per_m3(&self) -> f64 {
        self.density_kg_per_m3
    }

    #[getter]
    fn motor_distance_m(&self) -> f64 {
        self.wake.motor_distance_m()
    }

    #[getter]
    fn near_field_depth_m(&self) -> f64 {
        self.wake.near_field_depth_m()
    }

    fn speed<'py>(
        &self,
        py: Python<'py>,
        offsets_m: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let offsets_m = vectors(&offsets_m)?;
        let speeds_mps = offsets_m.iter().map(|it| self.wake.axial_speed_mps(*it));
        Ok(speeds_mps.collect::<Array1<f64>>().into_pyarray(py))
    }

    fn velocity<'py>(
        &self,
        py: Python<'py>,
        offsets_m: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let offsets_m = vectors(&offsets_m)?;
        let mut found = Array2::zeros((offsets_m.len(), 3));
        for (mut row, offset_m) in found.outer_iter_mut().zip(offsets_m) {
            let velocity_mps = self.wake.velocity_mps(offset_m);
            row.assign(&ArrayView1::from(velocity_mps.as_slice()));
        }
        Ok(found.into_pyarray(py))
    }

    fn mean_over_discs<'py>(
        &self,
        py: Python<'py>,
        receiver: &Air,
        offsets_m: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let source = Source {
            wake: &self.wake,
            position_m: Point3::origin(),
            ends_at_z_m: f64::NEG_INFINITY,
        };
        let discs = receiver.airframe.disc_points();
        let mean_mps = |offset_m: &Vector3<f64>| {
            let centre_m = Point3::from(*offset_m);
            mean_over_discs_mps(&[source], &discs, centre_m, Superposition::Momentum)
        };
        let means: Array1<f64> = vectors(&offsets_m)?.iter().map(mean_mps).collect();
        Ok(means.into_pyarray(py))
    }
}

/// One drone in the wake of another, both hovering.
#[pyclass(frozen)]
pub(crate) struct Separation(separation::Separation);

/// Air, alpha and power, by depth and offset.
type ExposureArrays<'py> = [Bound<'py, PyArray2<f64>>; 3];

#[pymethods]
impl Separation {
    #[new]
    fn new(lower: &Air, upper: &Air) -> Separation {
        let (mass_kg, density_kg_per_m3) = (lower.mass_kg, lower.density_kg_per_m3);
        let wake = upper.wake.clone();
        Separation(separation::Separation::new(
            &lower.airframe,
            mass_kg,
            density_kg_per_m3,
            wake,
        ))
    }

    fn met<'py>(
        &self,
        py: Python<'py>,
        below_m: PyReadonlyArray1<'py, f64>,
        beside_m: PyReadonlyArray1<'py, f64>,
    ) -> ExposureArrays<'py> {
        let (below_m, beside_m) = (below_m.as_array(), beside_m.as_array());
        let size = (below_m.len(), beside_m.len());
        let met = Array2::from_shape_fn(size, |(i, j)| self.0.met(below_m[i], beside_m[j]));
        [
            met.map(|it| it.air_mps),
            met.map(|it| it.alpha),
            met.map(|it| it.power),
        ]
        .map(|values| values.into_pyarray(py))
    }

    fn below_m(&self, alpha: f64, beside_m: f64) -> f64 {
        self.0.below_m(alpha, beside_m)
    }
}

/// Rows of three finite numbers.
fn vectors(rows: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<Vector3<f64>>> {
    let rows = rows.as_array();
    if rows.ncols() != 3 {
        let told = format!(
            "an array of shape (n, 3) is asked for, not (n, {})",
            rows.ncols()
        );
        return Err(PyValueError::new_err(told));
    }
    let found: Vec<Vector3<f64>> = rows
        .outer_iter()
        .map(|row| Vector3::new(row[0], row[1], row[2]))
        .collect();
    match found
        .iter()
        .position(|it| !it.iter().all(|x| x.is_finite()))
    {
        Some(row) => Err(PyValueError::new_err(format!("row {row} is not finite"))),
        None => Ok(found),
    }
}
