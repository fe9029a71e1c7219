//! What a competition lets controllers see.

use super::file::Mode;
use palmares_protocol::{Code, Refusal};
use palmares_tasks::{Noise, Sensing};

/// Which senses runs are played with.
#[derive(Clone, Debug)]
pub(crate) struct SensingRules {
    /// Whether the organizer decides on the noise.
    official: bool,
    /// The noise of a run that does not ask for another.
    noise: Noise,
    /// Tasks whose runs may not ask for the truth.
    sensors_only: Vec<String>,
}

impl SensingRules {
    /// As the file has it: in a competition sensors are those of real hands, in practice they are ideal.
    pub(super) fn new(mode: Mode, noise: Option<Noise>, sensors_only: Vec<String>) -> Self {
        let official = mode == Mode::Official;
        let usual = if official { Noise::Real } else { Noise::None };
        SensingRules { official, noise: noise.unwrap_or(usual), sensors_only }
    }

    /// Names of tasks whose runs may not ask for the truth.
    pub(crate) fn sensors_only(&self) -> &[String] {
        &self.sensors_only
    }

    /// The noise of runs that do not ask for another.
    pub(crate) fn usual_noise(&self) -> Noise {
        self.noise
    }

    /// The noise of a run that asked for `asked`.
    ///
    /// # Errors
    /// The organizer has decided otherwise.
    pub(crate) fn noise(&self, asked: Option<Noise>) -> Result<Noise, Refusal> {
        match asked {
            Some(asked) if self.official && asked != self.noise => {
                let set = serde_json::to_string(&self.noise).unwrap_or_default();
                let message = format!("noise: the organizer has set it to {set}; leave it out");
                Err(Refusal::new(Code::BadRequest, message))
            }
            asked => Ok(asked.unwrap_or(self.noise)),
        }
    }

    /// Whether a run of this task may be opened with this sensing.
    ///
    /// # Errors
    /// It asks for the truth, which the organizer does not show.
    pub(crate) fn may_see(&self, task: &str, sensing: Sensing) -> Result<(), Refusal> {
        if sensing == Sensing::Truth && self.sensors_only.iter().any(|name| name == task) {
            let message = format!("sensing: task `{task}` is played with \"sensors\" only here");
            return Err(Refusal::new(Code::BadRequest, message));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn in_practice_everybody_chooses_and_in_a_competition_the_organizer() {
        let practice = SensingRules::new(Mode::Practice, None, vec![]);
        assert_eq!(practice.noise(None), Ok(Noise::None));
        assert_eq!(practice.noise(Some(Noise::Real)), Ok(Noise::Real));
        let official = SensingRules::new(Mode::Official, None, vec!["shelf".into()]);
        assert_eq!(official.noise(None), Ok(Noise::Real));
        assert_eq!(official.noise(Some(Noise::Real)), Ok(Noise::Real));
        let refusal = official.noise(Some(Noise::None)).expect_err("refused");
        assert!(refusal.message.contains("\"real\""), "{}", refusal.message);
        assert_eq!(official.may_see("balls", Sensing::Truth), Ok(()));
        assert_eq!(official.may_see("shelf", Sensing::Sensors), Ok(()));
        assert!(official.may_see("shelf", Sensing::Truth).expect_err("refused").message.contains("shelf"));
    }
}
