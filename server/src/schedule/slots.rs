//! The slots of a team: whether it may begin a session now, and how long the session may last.

use palmares_protocol::{Code, Refusal, utc};
use palmares_store::Slot;

/// The slots of a team, by begin, and the present moment.
#[derive(Debug)]
pub(crate) struct Timetable<'a> {
    /// The slots.
    pub(crate) slots: &'a [Slot],
    /// Now, ms since 1970 UTC.
    pub(crate) now: i64,
    /// Begin of the competition's pause, if it is paused: no slot ends during a pause.
    pub(crate) paused: Option<i64>,
}

impl Timetable<'_> {
    /// The end of the slot in which the team may begin a session now, ms since 1970 UTC.
    ///
    /// # Errors
    /// The team has no slot now; the refusal says when the next one begins.
    pub(crate) fn admit(&self) -> Result<i64, Refusal> {
        let counts_until = self.paused.unwrap_or(self.now);
        let running = self
            .slots
            .iter()
            .find(|slot| slot.begins_unix_ms <= self.now && slot.ends_unix_ms > counts_until);
        match running {
            Some(slot) => Ok(slot.ends_unix_ms),
            None => Err(self.refusal()),
        }
    }

    fn refusal(&self) -> Refusal {
        if let Some(next) = self.slots.iter().find(|slot| slot.begins_unix_ms > self.now) {
            let wait_s = (next.begins_unix_ms - self.now) as f64 / 1000.0;
            let message = format!(
                "the team's slot begins at {}, in {}, and ends at {}. Until then practise on a server of your own: \
                 `palmares serve`, or Client(\"local\") in Python",
                utc(next.begins_unix_ms),
                in_words(wait_s),
                utc(next.ends_unix_ms)
            );
            return Refusal::new(Code::NotScheduled, message).retry_after(wait_s);
        }
        let message = match self.slots.last() {
            Some(last) => format!("the team's slot ended at {}; ask the organizer", utc(last.ends_unix_ms)),
            None => "the schedule has no slot for this team; ask the organizer".to_owned(),
        };
        Refusal::new(Code::NotScheduled, message)
    }
}

/// Hours, minutes and seconds.
fn in_words(seconds: f64) -> String {
    let seconds = seconds.ceil() as u64;
    format!("{}:{:02}:{:02}", seconds / 3600, seconds / 60 % 60, seconds % 60)
}

/// The new schedule in order.
///
/// # Errors
/// Two slots of one team overlap.
pub(crate) fn changed(mut slots: Vec<Slot>) -> Result<Vec<Slot>, String> {
    slots.sort_by(|a, b| (&a.team, a.begins_unix_ms).cmp(&(&b.team, b.begins_unix_ms)));
    for pair in slots.windows(2) {
        let [one, next] = pair else { continue };
        if one.team == next.team && next.begins_unix_ms < one.ends_unix_ms {
            return Err(format!(
                "two slots of {} overlap: {} to {}, and {} to {}",
                one.team,
                utc(one.begins_unix_ms),
                utc(one.ends_unix_ms),
                utc(next.begins_unix_ms),
                utc(next.ends_unix_ms)
            ));
        }
    }
    slots.sort();
    Ok(slots)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slot(begins_unix_ms: i64, ends_unix_ms: i64) -> Slot {
        Slot { begins_unix_ms, team: "crabs".into(), ends_unix_ms }
    }

    fn at(now: i64, paused: Option<i64>) -> Result<i64, (String, Option<f64>)> {
        let slots = [slot(10_000, 20_000), slot(50_000, 60_000)];
        let timetable = Timetable { slots: &slots, now, paused };
        timetable.admit().map_err(|refusal| {
            assert_eq!(refusal.code, Code::NotScheduled);
            (refusal.message, refusal.retry_after_s)
        })
    }

    #[test]
    fn a_team_begins_inside_a_slot_and_learns_when_the_next_one_begins() {
        let (message, wait_s) = at(9_000, None).expect_err("too early");
        assert!(
            message.contains("1970-01-01T00:00:10Z, in 0:00:01") && message.contains("practise"),
            "{message}"
        );
        assert_eq!(wait_s, Some(1.0));
        assert_eq!((at(10_000, None), at(19_999, None)), (Ok(20_000), Ok(20_000)));
        assert_eq!(at(20_000, None).expect_err("between").1, Some(30.0));
        assert_eq!(at(55_000, None), Ok(60_000));
        let (message, wait_s) = at(60_000, None).expect_err("too late");
        assert!(message.contains("ended at 1970-01-01T00:01:00Z"), "{message}");
        assert_eq!(wait_s, None);
        let none = Timetable { slots: &[], now: 0, paused: None }.admit().expect_err("no slot");
        assert!(none.message.contains("no slot for this team"), "{}", none.message);
    }

    #[test]
    fn no_slot_ends_during_a_pause() {
        assert_eq!(at(30_000, Some(15_000)), Ok(20_000));
        assert!(at(30_000, Some(20_000)).is_err());
        assert_eq!(at(51_000, Some(49_000)), Ok(60_000), "it begins during the pause");
    }

    #[test]
    fn slots_of_a_team_do_not_overlap() {
        assert!(changed(vec![slot(5, 9), slot(1, 5)]).is_ok_and(|slots| slots[0].begins_unix_ms == 1));
        let why = changed(vec![slot(1000, 6000), slot(5000, 9000)]).expect_err("overlap");
        assert!(why.contains("crabs") && why.contains("00:00:05Z"), "{why}");
    }
}
