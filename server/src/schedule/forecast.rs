//! How long it takes at most until a place is free.

/// An open session that may hold a place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlayingSession {
    /// Time left, s; None without a limit.
    pub(crate) left_s: Option<f64>,
    /// Whether its own clock is paused.
    pub(crate) paused: bool,
}

/// The places of the competition.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Forecast {
    /// Number of sessions that play.
    pub(crate) playing: usize,
    /// Longest time until a place is free for the next team, s: 0 if one is free; None if nothing bounds it, as during a pause.
    pub(crate) free_within_s: Option<f64>,
}

impl Forecast {
    /// The forecast for a team that comes after `waiting` others. A place becomes free when a session's time is spent; it can become
    /// free earlier.
    pub(crate) fn new(sessions: &[PlayingSession], places: usize, waiting: usize, paused: bool) -> Self {
        let playing = sessions.len();
        // Number of sessions that must end first.
        let ends = (playing + waiting + 1).saturating_sub(places);
        if ends == 0 {
            return Forecast { playing, free_within_s: Some(0.0) };
        }
        let mut left: Vec<f64> =
            sessions.iter().filter(|session| !session.paused).filter_map(|session| session.left_s).collect();
        left.sort_by(f64::total_cmp);
        let free_within_s = left.get(ends - 1).copied().filter(|_| !paused);
        Forecast { playing, free_within_s }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_free_when_enough_sessions_have_ended() {
        let session = |left_s| PlayingSession { left_s: Some(left_s), paused: false };
        let sessions = [session(30.0), session(10.0), session(20.0)];
        let within = |places, waiting| Forecast::new(&sessions, places, waiting, false).free_within_s;
        assert_eq!((within(4, 0), within(3, 0), within(3, 1)), (Some(0.0), Some(10.0), Some(20.0)));
        assert_eq!((within(3, 2), within(3, 3)), (Some(30.0), None), "others must play and end first");
        assert_eq!((within(5, 1), within(5, 2)), (Some(0.0), Some(10.0)));
        assert_eq!(Forecast::new(&sessions, 3, 0, true).free_within_s, None, "all clocks are stopped");
        let stopped = PlayingSession { paused: true, ..session(5.0) };
        let endless = PlayingSession { left_s: None, paused: false };
        let forecast = Forecast::new(&[stopped, endless, session(50.0)], 3, 0, false);
        assert_eq!(forecast, Forecast { playing: 3, free_within_s: Some(50.0) });
    }
}
