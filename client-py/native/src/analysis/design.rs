//! Variables and goals of a design as Python passes them.

use super::arrays::{Matrix, matrix, place_of};
use palmares_analysis::design::{Goal, Parameter, Variable};
use palmares_models::hand::Hand;
use pyo3::prelude::*;

/// `palmares.analysis.Variable`s: parameters as (kind, tendon, coordinate, factor), and bounds.
#[derive(FromPyObject)]
pub(crate) struct Variables(Vec<GivenVariable>);

#[derive(FromPyObject)]
struct GivenVariable {
    parameters: Vec<(String, String, String, f64)>,
    lower: f64,
    upper: f64,
}

/// `palmares.analysis.Postures` and `palmares.analysis.Forces`.
#[derive(FromPyObject)]
pub(crate) struct Goals<'py>(Vec<GivenGoal<'py>>);

#[derive(FromPyObject)]
enum GivenGoal<'py> {
    Postures {
        sigma: Vec<Vec<f64>>,
        q: Vec<Vec<f64>>,
        weight: f64,
    },
    Forces {
        sigma: Vec<f64>,
        jacobian: Matrix<'py>,
        posture: Vec<f64>,
        compliance: f64,
        shares: Vec<f64>,
        weight: f64,
    },
}

impl Variables {
    pub(crate) fn of(self, hand: &Hand) -> PyResult<Vec<Variable>> {
        let of = |given: GivenVariable| {
            let parameter = |(kind, tendon, coordinate, factor): (String, String, String, f64)| {
                let c = place_of("coordinate", &coordinate, hand.coordinates.iter().map(|c| &c.name))?;
                let parameter = match place_of("parameter", &kind, ["arm", "stiffness", "rest"].iter())? {
                    0 => {
                        let tendon = place_of("tendon", &tendon, hand.tendons.iter().map(|t| &t.name))?;
                        Parameter::Arm { tendon, coordinate: c }
                    }
                    1 => Parameter::Stiffness(c),
                    _ => Parameter::Rest(c),
                };
                Ok((parameter, factor))
            };
            let parameters = given.parameters.into_iter().map(parameter).collect::<PyResult<_>>()?;
            Ok(Variable { parameters, lower: given.lower, upper: given.upper })
        };
        self.0.into_iter().map(of).collect()
    }
}

impl Goals<'_> {
    pub(crate) fn of(&self) -> PyResult<Vec<Goal>> {
        let of = |given: &GivenGoal<'_>| {
            Ok(match given {
                GivenGoal::Postures { sigma, q, weight } => {
                    Goal::Postures { sigma: sigma.clone(), q: q.clone(), weight: *weight }
                }
                GivenGoal::Forces { sigma, jacobian, posture, compliance, shares, weight } => Goal::Forces {
                    sigma: sigma.clone(),
                    jacobian: matrix("jacobian", jacobian)?,
                    posture: posture.clone(),
                    compliance: *compliance,
                    shares: shares.clone(),
                    weight: *weight,
                },
            })
        };
        self.0.iter().map(of).collect()
    }
}
