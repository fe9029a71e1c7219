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
    /// The forecast for a team that comes after those that wait, whose times left are given in the order of the queue. A place is free when
    /// a session's time is spent; it can be free earlier.
    pub(crate) fn new(
        sessions: &[PlayingSession],
        waiting: &[Option<f64>],
        places: usize,
        paused: bool,
    ) -> Self {
        let playing = sessions.len();
        let endless = f64::INFINITY;
        let left = |session: &PlayingSession| session.left_s.filter(|_| !session.paused).unwrap_or(endless);
        let mut ends: Vec<f64> = sessions.iter().map(left).collect();
        ends.sort_by(f64::total_cmp);
        // When each place is free. More sessions than places can play: some are idle.
        let mut free = vec![0.0; places.saturating_sub(playing)];
        free.extend(ends.into_iter().skip(playing.saturating_sub(places)));
        for left_s in waiting {
            // The next in the queue takes the place that is free first.
            if let Some(first) = free.iter_mut().min_by(|a, b| a.total_cmp(b)) {
                *first += left_s.unwrap_or(endless);
            }
        }
        let first = free.into_iter().min_by(f64::total_cmp);
        let free_within_s = first.filter(|first| first.is_finite() && (*first == 0.0 || !paused));
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
        let within =
            |places, waiting: &[Option<f64>]| Forecast::new(&sessions, waiting, places, false).free_within_s;
        assert_eq!((within(4, &[]), within(3, &[])), (Some(0.0), Some(10.0)));
        assert_eq!(within(3, &[Some(100.0)]), Some(20.0), "one that waits takes the first place");
        assert_eq!(within(3, &[Some(5.0)]), Some(15.0), "and is done before another one is free");
        assert_eq!(within(3, &[Some(9.0), Some(9.0), Some(9.0)]), Some(28.0));
        assert_eq!((within(4, &[Some(7.0)]), within(3, &[None])), (Some(7.0), Some(20.0)));
        assert_eq!((within(2, &[]), within(1, &[]), within(0, &[])), (Some(20.0), Some(30.0), None));
        assert_eq!(Forecast::new(&sessions, &[], 3, true).free_within_s, None, "all clocks are stopped");
        assert_eq!(Forecast::new(&sessions, &[], 4, true).free_within_s, Some(0.0));
        let stopped = PlayingSession { paused: true, ..session(5.0) };
        let endless = PlayingSession { left_s: None, paused: false };
        let forecast = Forecast::new(&[stopped, endless, session(50.0)], &[], 3, false);
        assert_eq!(forecast, Forecast { playing: 3, free_within_s: Some(50.0) });
    }
}
