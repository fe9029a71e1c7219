//! Observations that controllers may have in a competition.

use super::file::CompetitionMode;
use palmares_protocol::{Code, Refusal};
use palmares_tasks::{Noise, Sensing};

/// Noise and true state in runs.
#[derive(Clone, Debug)]
pub struct SensingRules {
    /// Whether the organizer sets the noise.
    official: bool,
    /// The default noise of a run.
    noise: Noise,
    /// Tasks whose runs may not request the true state.
    sensors_only: Vec<String>,
}

impl SensingRules {
    /// The rules of the file. The default noise is that of real sensors in a competition, and none in practice.
    pub(super) fn new(mode: CompetitionMode, noise: Option<Noise>, sensors_only: Vec<String>) -> Self {
        let official = mode == CompetitionMode::Official;
        let usual = if official { Noise::Real } else { Noise::None };
        SensingRules { official, noise: noise.unwrap_or(usual), sensors_only }
    }

    /// Names of tasks whose runs may not request the true state.
    pub fn sensors_only(&self) -> &[String] {
        &self.sensors_only
    }

    /// The default noise of a run.
    pub fn usual_noise(&self) -> Noise {
        self.noise
    }

    /// The noise of a run that requests `requested`.
    ///
    /// # Errors
    /// The organizer has set another noise.
    pub fn noise(&self, requested: Option<Noise>) -> Result<Noise, Refusal> {
        match requested {
            Some(requested) if self.official && requested != self.noise => {
                let set = serde_json::to_string(&self.noise).unwrap_or_default();
                let message = format!("noise: the organizer has set it to {set}; leave it out");
                Err(Refusal::new(Code::BadRequest, message))
            }
            requested => Ok(requested.unwrap_or(self.noise)),
        }
    }

    /// Checks the sensing of a new run of this task.
    ///
    /// # Errors
    /// It requests the true state, which the organizer does not allow.
    pub fn check_sensing(&self, task: &str, sensing: Sensing) -> Result<(), Refusal> {
        if sensing == Sensing::Truth && self.sensors_only.iter().any(|name| name == task) {
            let message = format!("sensing: task `{task}` allows only \"sensors\" here");
            return Err(Refusal::new(Code::BadRequest, message));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn in_practice_the_client_chooses_and_in_a_competition_the_organizer() {
        let practice = SensingRules::new(CompetitionMode::Practice, None, vec![]);
        assert_eq!(practice.noise(None), Ok(Noise::None));
        assert_eq!(practice.noise(Some(Noise::Real)), Ok(Noise::Real));
        let official = SensingRules::new(CompetitionMode::Official, None, vec!["shelf".into()]);
        assert_eq!(official.noise(None), Ok(Noise::Real));
        assert_eq!(official.noise(Some(Noise::Real)), Ok(Noise::Real));
        let refusal = official.noise(Some(Noise::None)).expect_err("refused");
        assert!(refusal.message.contains("\"real\""), "{}", refusal.message);
        assert_eq!(official.check_sensing("balls", Sensing::Truth), Ok(()));
        assert_eq!(official.check_sensing("shelf", Sensing::Sensors), Ok(()));
        assert!(
            official.check_sensing("shelf", Sensing::Truth).expect_err("refused").message.contains("shelf")
        );
    }
}
