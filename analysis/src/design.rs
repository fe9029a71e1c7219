//! Design of a hand: moment arms R, springs E and rest positions q₀ that meet a goal, with gradients of the closed form.
//!
//! At constant R the equilibrium is `E (q − q₀) = Rᵀ f − Jᵀ λ`, `R q + K⁻¹ f = s`, `J q − C λ = J q*` for contacts with the
//! compliance C whose points touch at the posture q*. Its derivative by a parameter is the same linear system with another right side, so that a gradient
//! costs no more than the equilibrium. The goals are sums of squares; [`optimise`] is the projected Levenberg–Marquardt method.

use crate::hand::{balance, balanced_inverse, spring_stiffness};
use nalgebra::{DMatrix, DVector};
use palmares_models::hand::Hand;
use palmares_sim::statics::drives::wound_lengths;

/// A number of a hand that a design may change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parameter {
    /// Moment arm of a tendon at a coordinate: an entry of R; in metres, a radius.
    Arm {
        /// Index of the tendon.
        tendon: usize,
        /// Index of the coordinate.
        coordinate: usize,
    },
    /// Stiffness E of a coordinate.
    Stiffness(usize),
    /// Rest position q₀ of a coordinate.
    Rest(usize),
}

/// A design variable: its value times each factor is the value of a parameter, so that one radius can serve several joints.
#[derive(Clone, Debug, PartialEq)]
pub struct Variable {
    /// Parameters, each with its factor.
    pub parameters: Vec<(Parameter, f64)>,
    /// Smallest value.
    pub lower: f64,
    /// Largest value.
    pub upper: f64,
}

/// The aim of a design. Weights multiply the differences.
#[derive(Clone, Debug)]
pub enum Goal {
    /// Coordinates of the free hand at several σ; NaN for those that do not matter.
    Postures {
        /// σ of every motor, for each posture.
        sigma: Vec<Vec<f64>>,
        /// Coordinates, for each posture.
        q: Vec<Vec<f64>>,
        /// Weight of a difference of 1 rad or 1 m.
        weight: f64,
    },
    /// Normal forces of contacts at one σ, in given proportions. The difference is that of forces and shares, each over
    /// their root mean square: smooth where a force changes its sign. Equal shares ask for equal forces.
    Forces {
        /// σ of every motor.
        sigma: Vec<f64>,
        /// Rows of J of the contacts' normals, contacts × coordinates, at the posture in which they touch.
        jacobian: DMatrix<f64>,
        /// That posture q*.
        posture: Vec<f64>,
        /// Compliance of each contact, m/N.
        compliance: f64,
        /// Share of each contact.
        shares: Vec<f64>,
        /// Weight of a difference of 1.
        weight: f64,
    },
}

/// A design that cannot be computed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoDesign {
    /// Tendons with arms that vary.
    #[error("tendon `{0}` has no constant moment arms, which the closed form needs")]
    VaryingArms(String),
    /// A closed chain of links.
    #[error("linkage `{0}` closes a chain of links, for which there is no closed form")]
    ClosedChain(String),
    /// A parameter that the hand does not have.
    #[error("variable {variable}: the hand has no such tendon or coordinate")]
    Parameter {
        /// Index of the variable.
        variable: usize,
    },
    /// Bounds or starting values.
    #[error(
        "variable {variable}: its bounds are {lower} to {upper}; valid: finite, the lower not above the upper, a stiffness above 0"
    )]
    Bounds {
        /// Index of the variable.
        variable: usize,
        /// Its lower bound.
        lower: f64,
        /// Its upper bound.
        upper: f64,
    },
    /// A goal whose lists have the wrong lengths.
    #[error("goal {goal}: {what} has {found} entries; valid: {wanted}")]
    Goal {
        /// Index of the goal.
        goal: usize,
        /// Name of the list.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The valid length.
        wanted: usize,
    },
    /// The equilibrium is not determined.
    #[error("springs, tendons and contacts do not determine the equilibrium")]
    Singular,
}

/// R, E, q₀, K of a hand, which a design changes.
#[derive(Clone, Debug)]
pub struct Design {
    /// R, m × n.
    pub r: DMatrix<f64>,
    /// E, n × n.
    pub e: DMatrix<f64>,
    /// q₀
    pub rest: DVector<f64>,
    /// K⁻¹
    give: Vec<f64>,
    /// The part of E that springs across joints have, and their torques at q = 0.
    coupling: (DMatrix<f64>, DVector<f64>),
    hand: Hand,
}

/// The end of an optimisation.
#[derive(Clone, Debug)]
pub struct Optimum {
    /// Values of the variables.
    pub values: DVector<f64>,
    /// Half the sum of the squares.
    pub cost: f64,
    /// The same for each step, from the start.
    pub history: Vec<f64>,
    /// Whether no step within the bounds lowers the cost any more.
    pub converged: bool,
}

impl Design {
    /// The numbers of a hand.
    ///
    /// # Errors
    /// A tendon without constant moment arms, or a closed chain.
    pub fn of(hand: &Hand) -> Result<Self, NoDesign> {
        if let Some(pin) = hand.linkages.first() {
            return Err(NoDesign::ClosedChain(pin.name.clone()));
        }
        if let Some(tendon) = hand.tendons.iter().find(|tendon| !tendon.elements.is_empty()) {
            return Err(NoDesign::VaryingArms(tendon.name.clone()));
        }
        Ok(Design {
            r: crate::hand::moment_arms(hand, &vec![0.0; hand.coordinates.len()]),
            e: spring_stiffness(hand),
            rest: DVector::from_iterator(hand.coordinates.len(), hand.coordinates.iter().map(|c| c.rest)),
            give: hand.tendons.iter().map(|tendon| 1.0 / tendon.stiffness).collect(),
            coupling: coupling(hand),
            hand: hand.clone(),
        })
    }

    /// The value of a parameter.
    pub fn get(&self, parameter: Parameter) -> f64 {
        match parameter {
            Parameter::Arm { tendon, coordinate } => self.r[(tendon, coordinate)],
            Parameter::Stiffness(c) => self.own_stiffness(c),
            Parameter::Rest(c) => self.rest[c],
        }
    }

    /// E of a coordinate's own spring.
    fn own_stiffness(&self, c: usize) -> f64 {
        self.e[(c, c)] - self.coupling.0[(c, c)]
    }

    /// Sets the parameters of variables to their values.
    pub fn set(&mut self, variables: &[Variable], values: &DVector<f64>) {
        for (variable, value) in variables.iter().zip(values) {
            for (parameter, factor) in &variable.parameters {
                let value = factor * value;
                match *parameter {
                    Parameter::Arm { tendon, coordinate } => self.r[(tendon, coordinate)] = value,
                    Parameter::Stiffness(c) => self.e[(c, c)] = value + self.coupling.0[(c, c)],
                    Parameter::Rest(c) => self.rest[c] = value,
                }
            }
        }
    }

    /// The values that variables have now: of their first parameters.
    pub fn values(&self, variables: &[Variable]) -> DVector<f64> {
        let value = |variable: &Variable| {
            variable.parameters.first().map_or(0.0, |(parameter, factor)| self.get(*parameter) / factor)
        };
        DVector::from_iterator(variables.len(), variables.iter().map(value))
    }

    /// q, f and λ at σ, with contacts of a compliance along rows of J that touch at q*, and their derivatives by the variables.
    fn equilibrium(
        &self,
        sigma: &[f64],
        contacts: Option<(&DMatrix<f64>, &[f64], f64)>,
        variables: &[Variable],
    ) -> Result<(DVector<f64>, DMatrix<f64>), NoDesign> {
        let (m, n) = self.r.shape();
        let c = contacts.map_or(0, |(jacobian, ..)| jacobian.nrows());
        let mut all = balance(&self.e, &self.r, &self.give, c);
        let mut right = DVector::zeros(n + m + c);
        for i in 0..n {
            right[i] = self.own_stiffness(i) * self.rest[i] + self.coupling.1[i];
        }
        right.rows_mut(n, m).copy_from_slice(&wound_lengths(&self.hand, sigma));
        if let Some((jacobian, touching, compliance)) = contacts {
            all.view_mut((0, n + m), (n, c)).copy_from(&jacobian.transpose());
            all.view_mut((n + m, 0), (c, n)).copy_from(jacobian);
            for i in 0..c {
                all[(n + m + i, n + m + i)] = -compliance;
            }
            right.rows_mut(n + m, c).copy_from(&(jacobian * DVector::from_row_slice(touching)));
        }
        // Unknowns q, −f, λ.
        let inverse = balanced_inverse(all).ok_or(NoDesign::Singular)?;
        let mut found = &inverse * right;
        let mut slopes = DMatrix::zeros(n + m + c, variables.len());
        for (k, variable) in variables.iter().enumerate() {
            for &(parameter, factor) in &variable.parameters {
                match parameter {
                    // With −f for f: dRᵀ (−f) moves to the right side, and dR q.
                    Parameter::Arm { tendon, coordinate } => {
                        slopes[(coordinate, k)] -= factor * found[n + tendon];
                        slopes[(n + tendon, k)] -= factor * found[coordinate];
                    }
                    Parameter::Stiffness(i) => slopes[(i, k)] -= factor * (found[i] - self.rest[i]),
                    Parameter::Rest(i) => slopes[(i, k)] += factor * self.own_stiffness(i),
                }
            }
        }
        let mut slopes = &inverse * slopes;
        found.rows_mut(n, m).neg_mut();
        slopes.rows_mut(n, m).neg_mut();
        Ok((found, slopes))
    }

    /// Differences from the goals, and their derivatives by the variables.
    ///
    /// # Errors
    /// A goal or variable that does not fit the hand.
    pub fn differences(
        &self,
        goals: &[Goal],
        variables: &[Variable],
    ) -> Result<(DVector<f64>, DMatrix<f64>), NoDesign> {
        let (m, n) = self.r.shape();
        let mut values = Vec::new();
        let mut slopes: Vec<nalgebra::RowDVector<f64>> = Vec::new();
        for (index, goal) in goals.iter().enumerate() {
            let length = |what, found: usize, wanted: usize| {
                if found == wanted {
                    Ok(())
                } else {
                    Err(NoDesign::Goal { goal: index, what, found, wanted })
                }
            };
            match goal {
                Goal::Postures { sigma, q, weight } => {
                    length("q", q.len(), sigma.len())?;
                    for (sigma, wanted) in sigma.iter().zip(q) {
                        length("sigma", sigma.len(), self.hand.motors.len())?;
                        length("q", wanted.len(), n)?;
                        let (found, slope) = self.equilibrium(sigma, None, variables)?;
                        for i in (0..n).filter(|&i| !wanted[i].is_nan()) {
                            values.push(weight * (found[i] - wanted[i]));
                            slopes.push(slope.row(i) * *weight);
                        }
                    }
                }
                Goal::Forces { sigma, jacobian, posture, compliance, shares, weight } => {
                    length("sigma", sigma.len(), self.hand.motors.len())?;
                    length("posture", posture.len(), n)?;
                    length("jacobian", jacobian.ncols(), n)?;
                    length("shares", shares.len(), jacobian.nrows())?;
                    let contacts = Some((jacobian, posture.as_slice(), *compliance));
                    let (found, slope) = self.equilibrium(sigma, contacts, variables)?;
                    let count = shares.len();
                    let forces = found.rows(n + m, count);
                    let root_mean_square = |squares: f64| (squares / count as f64).sqrt();
                    let size = root_mean_square(forces.norm_squared()).max(f64::MIN_POSITIVE);
                    let size_slope = forces.transpose() * slope.rows(n + m, count) / (count as f64 * size);
                    let share = 1.0 / root_mean_square(shares.iter().map(|x| x * x).sum());
                    for (i, wanted) in shares.iter().enumerate() {
                        let force = found[n + m + i];
                        values.push(weight * (force / size - share * wanted));
                        let slope = slope.row(n + m + i) / size - &size_slope * (force / (size * size));
                        slopes.push(slope * *weight);
                    }
                }
            }
        }
        let slopes =
            if slopes.is_empty() { DMatrix::zeros(0, variables.len()) } else { DMatrix::from_rows(&slopes) };
        Ok((DVector::from_vec(values), slopes))
    }

    /// Normal forces of contacts and coordinates at σ: those of [`Goal::Forces`].
    ///
    /// # Errors
    /// The equilibrium is not determined.
    pub fn forces(
        &self,
        sigma: &[f64],
        jacobian: &DMatrix<f64>,
        posture: &[f64],
        compliance: f64,
    ) -> Result<DVector<f64>, NoDesign> {
        let (m, n) = self.r.shape();
        let (found, _) = self.equilibrium(sigma, Some((jacobian, posture, compliance)), &[])?;
        Ok(found.rows(n + m, jacobian.nrows()).into_owned())
    }

    fn check(&self, variables: &[Variable]) -> Result<(), NoDesign> {
        let (m, n) = self.r.shape();
        for (index, variable) in variables.iter().enumerate() {
            let Variable { parameters, lower, upper } = variable;
            let known = |(parameter, factor): &(Parameter, f64)| {
                factor.is_finite()
                    && *factor != 0.0
                    && match *parameter {
                        Parameter::Arm { tendon, coordinate } => tendon < m && coordinate < n,
                        Parameter::Stiffness(c) | Parameter::Rest(c) => c < n,
                    }
            };
            if parameters.is_empty() || !parameters.iter().all(known) {
                return Err(NoDesign::Parameter { variable: index });
            }
            let stiff = |(parameter, factor): &(Parameter, f64)| {
                !matches!(parameter, Parameter::Stiffness(_)) || factor * lower > 0.0
            };
            if !(lower <= upper && lower.is_finite() && upper.is_finite() && parameters.iter().all(stiff)) {
                return Err(NoDesign::Bounds { variable: index, lower: *lower, upper: *upper });
            }
        }
        Ok(())
    }
}

/// Stiffness and torques at q = 0 of the springs across joints.
fn coupling(hand: &Hand) -> (DMatrix<f64>, DVector<f64>) {
    let n = hand.coordinates.len();
    let mut stiffness = spring_stiffness(hand);
    let mut torque = DVector::zeros(n);
    for (i, c) in hand.coordinates.iter().enumerate() {
        stiffness[(i, i)] -= c.stiffness;
    }
    for spring in &hand.springs {
        for &(i, arm) in &spring.arms {
            torque[i] += spring.stiffness * arm * spring.rest;
        }
    }
    (stiffness, torque)
}

/// Steps end when the cost falls by less than this part.
const PROGRESS: f64 = 1e-14;

/// Lowers half the sum of the squared differences from the goals, within the variables' bounds, from the present values.
///
/// # Errors
/// A goal or variable that does not fit the hand.
pub fn optimise(
    design: &mut Design,
    variables: &[Variable],
    goals: &[Goal],
    steps: usize,
) -> Result<Optimum, NoDesign> {
    design.check(variables)?;
    let within = |values: &mut DVector<f64>| {
        values.iter_mut().zip(variables).for_each(|(value, v)| *value = value.clamp(v.lower, v.upper));
    };
    // In units of each variable's range, so that radii and stiffnesses weigh the same.
    let scale = DVector::from_iterator(
        variables.len(),
        variables.iter().map(|v| if v.upper > v.lower { v.upper - v.lower } else { 1.0 }),
    );
    let mut values = design.values(variables);
    within(&mut values);
    design.set(variables, &values);
    let (mut differences, mut slopes) = design.differences(goals, variables)?;
    let mut cost = 0.5 * differences.norm_squared();
    let mut history = vec![cost];
    let mut damping = 1e-6;
    let mut converged = cost == 0.0;
    for _ in 0..steps {
        if converged {
            break;
        }
        let scaled = &slopes * DMatrix::from_diagonal(&scale);
        let gradient = scaled.transpose() * &differences;
        // Variables at a bound that the cost pushes outward stay there.
        let free: Vec<usize> = (0..values.len())
            .filter(|&k| {
                let (v, g) = (&variables[k], gradient[k]);
                v.upper > v.lower && !(values[k] <= v.lower && g > 0.0) && !(values[k] >= v.upper && g < 0.0)
            })
            .collect();
        let mut improved = false;
        while !free.is_empty() && damping < 1e12 {
            let part = scaled.select_columns(&free);
            let mut normal = part.transpose() * &part;
            let size = normal.diagonal().max().max(f64::MIN_POSITIVE);
            for k in 0..free.len() {
                normal[(k, k)] += damping * size;
            }
            let Some(factor) = normal.cholesky() else {
                damping *= 10.0;
                continue;
            };
            let step = factor.solve(&gradient.select_rows(&free));
            let mut next = values.clone();
            for (k, &at) in free.iter().enumerate() {
                next[at] -= scale[at] * step[k];
            }
            within(&mut next);
            let mut tried = design.clone();
            tried.set(variables, &next);
            let found = tried.differences(goals, variables);
            if let Ok((d, s)) = found {
                let there = 0.5 * d.norm_squared();
                if there < cost {
                    let fell = cost - there;
                    (differences, slopes, values) = (d, s, next);
                    *design = tried;
                    converged = fell <= PROGRESS * cost || there < 1e-28;
                    cost = there;
                    history.push(cost);
                    damping = (damping * 0.2).max(1e-14);
                    improved = true;
                    break;
                }
            }
            damping *= 10.0;
        }
        if !improved {
            converged = true;
        }
    }
    Ok(Optimum { values, cost, history, converged })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pinch() -> Hand {
        Hand::clone(&Hand::builtin("pinch").expect("it is built in"))
    }

    fn variables() -> Vec<Variable> {
        let one = |parameter| Variable { parameters: vec![(parameter, 1.0)], lower: 1e-4, upper: 0.5 };
        vec![
            // The pulleys of both fingers are of one radius.
            Variable {
                parameters: vec![
                    (Parameter::Arm { tendon: 0, coordinate: 0 }, 1.0),
                    (Parameter::Arm { tendon: 0, coordinate: 2 }, 1.0),
                ],
                lower: 1e-3,
                upper: 1e-2,
            },
            one(Parameter::Arm { tendon: 1, coordinate: 1 }),
            one(Parameter::Stiffness(1)),
            Variable { parameters: vec![(Parameter::Rest(3), 1.0)], lower: -0.5, upper: 0.5 },
        ]
    }

    fn goals(hand: &Hand) -> Vec<Goal> {
        let n = hand.coordinates.len();
        let jacobian = DMatrix::from_fn(2, n, |i, k| if k / 2 == i { 0.05 + 0.01 * k as f64 } else { 0.0 });
        vec![
            Goal::Postures {
                sigma: vec![vec![0.2, 0.3], vec![0.4, 0.1]],
                q: vec![vec![0.3; n], vec![f64::NAN, 0.1, 0.2, 0.3]],
                weight: 2.0,
            },
            Goal::Forces {
                sigma: vec![0.5, 0.5],
                jacobian,
                posture: vec![0.1; n],
                compliance: 1e-4,
                shares: vec![1.0, 2.0],
                weight: 0.7,
            },
        ]
    }

    #[test]
    fn gradients_are_those_of_the_closed_form_by_differences() {
        let hand = pinch();
        let (goals, variables) = (goals(&hand), variables());
        let design = Design::of(&hand).expect("constant arms");
        let (_, slopes) = design.differences(&goals, &variables).expect("differences");
        let values = design.values(&variables);
        for k in 0..variables.len() {
            let step = 1e-6 * values[k].abs().max(1e-3);
            let at = |by: f64| {
                let mut moved = design.clone();
                let mut values = values.clone();
                values[k] += by;
                moved.set(&variables, &values);
                moved.differences(&goals, &variables).expect("differences").0
            };
            let numeric = (at(step) - at(-step)) / (2.0 * step);
            let size = numeric.amax().max(1.0);
            assert!((numeric - slopes.column(k)).amax() < 1e-6 * size, "{k}");
        }
    }

    /// Postures that another design reaches: the optimum finds them, and their radii and springs.
    #[test]
    fn a_reachable_trajectory_is_reached() {
        let hand = pinch();
        let variables = variables();
        let mut wanted = Design::of(&hand).expect("constant arms");
        let values = DVector::from_vec(vec![0.0035, 0.0024, 0.07, -0.2]);
        wanted.set(&variables, &values);
        let sigma: Vec<Vec<f64>> =
            (1..5).map(|k| vec![0.1 * f64::from(k), 0.05 * f64::from(k * k)]).collect();
        let q = |sigma: &Vec<f64>| {
            let (found, _) = wanted.equilibrium(sigma, None, &[]).expect("an equilibrium");
            found.rows(0, 4).iter().copied().collect()
        };
        let goal = Goal::Postures { q: sigma.iter().map(q).collect(), sigma, weight: 1.0 };
        let mut design = Design::of(&hand).expect("constant arms");
        let found = optimise(&mut design, &variables, &[goal], 200).expect("an optimum");
        assert!(found.cost < 1e-20, "{:?}", found.history);
        assert!((&found.values - &values).amax() < 1e-6, "{}", found.values);
        assert!(found.history.windows(2).all(|pair| pair[1] < pair[0]));
    }

    #[test]
    fn equal_forces_are_reached_within_the_bounds() {
        let hand = pinch();
        let jacobian = DMatrix::from_row_slice(2, 4, &[0.04, 0.0, 0.0, 0.0, 0.08, 0.04, 0.0, 0.0]);
        let forces =
            |design: &Design| design.forces(&[0.6, 0.6], &jacobian, &[0.1; 4], 1e-6).expect("forces");
        let mut design = Design::of(&hand).expect("constant arms");
        let before = forces(&design);
        assert!((before[0] / before[1] - 1.0).abs() > 0.1, "{before}");
        let goal = Goal::Forces {
            sigma: vec![0.6, 0.6],
            jacobian: jacobian.clone(),
            posture: vec![0.1; 4],
            compliance: 1e-6,
            shares: vec![1.0, 1.0],
            weight: 1.0,
        };
        let arm = |tendon, coordinate| Variable {
            parameters: vec![(Parameter::Arm { tendon, coordinate }, 1.0)],
            lower: 1e-4,
            upper: 0.02,
        };
        let found =
            optimise(&mut design, &[arm(0, 0), arm(0, 1), arm(1, 1)], &[goal], 100).expect("an optimum");
        let after = forces(&design);
        assert!((after[0] / after[1] - 1.0).abs() < 1e-8, "{after} {:?}", found.history);
    }

    #[test]
    fn what_does_not_fit_the_hand_is_refused() {
        let mut design = Design::of(&pinch()).expect("constant arms");
        let variable = |parameter, lower| Variable { parameters: vec![(parameter, 1.0)], lower, upper: 1.0 };
        let refused =
            optimise(&mut design, &[variable(Parameter::Rest(9), 0.0)], &[], 1).expect_err("no joint 9");
        assert_eq!(refused, NoDesign::Parameter { variable: 0 });
        let refused =
            optimise(&mut design, &[variable(Parameter::Stiffness(0), 0.0)], &[], 1).expect_err("it");
        assert!(refused.to_string().contains("a stiffness above 0"), "{refused}");
        let reflex = Hand::builtin("reflex").expect("it is built in");
        assert!(matches!(Design::of(&reflex), Err(NoDesign::VaryingArms(_))));
    }
}
