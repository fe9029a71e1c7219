//! The last request that changed a run, and its reply. A client that comes back on another connection may have missed the reply: it
//! sends the same request with the same id once more and gets the reply once more. Nothing is carried out twice.

use palmares_protocol::{Refusal, Reply, Request};

/// The last request that changed a run, with its reply.
#[derive(Debug, Default)]
pub(super) struct Answered {
    last: Option<Last>,
    /// Whether the client has come back on another connection since then.
    back: bool,
}

#[derive(Debug)]
struct Last {
    id: u64,
    request: Request,
    /// None while it is being sent.
    reply: Option<Result<Reply, Refusal>>,
}

impl Answered {
    /// The client is back on another connection.
    pub(super) fn client_is_back(&mut self) {
        self.back = true;
    }

    /// The reply to a request that a client which is back sends again. The caller gives it to [`Answered::keep`] after it was sent.
    pub(super) fn again(&mut self, id: u64, request: &Request) -> Option<Result<Reply, Refusal>> {
        let last =
            self.last.as_mut().filter(|last| self.back && last.id == id && last.request == *request)?;
        match &last.reply {
            Some(Err(refusal)) => Some(Err(refusal.clone())),
            _ => last.reply.take(),
        }
    }

    /// A request was carried out. One that changed no run, and a refused one, leave nothing to repeat; a world that failed does.
    pub(super) fn carried_out(&mut self, id: u64, request: Request, answer: &Result<Reply, Refusal>) {
        let changes =
            matches!(request, Request::Reset(_) | Request::Step(_) | Request::Perturb(_) | Request::Stop(_));
        let reply = match answer {
            Ok(_) => None,
            Err(refusal) if refusal.fault.is_some() => Some(Err(refusal.clone())),
            Err(_) => return,
        };
        if changes {
            *self = Answered { last: Some(Last { id, request, reply }), back: false };
        }
    }

    /// Keeps a reply after it was sent, or after its connection broke.
    pub(super) fn keep(&mut self, reply: Reply) {
        let id = match &reply {
            Reply::Obs(obs) => obs.id,
            Reply::Ack(ack) => Some(ack.id),
            Reply::Result(result) => result.id,
            _ => return,
        };
        if let Some(last) = &mut self.last
            && last.reply.is_none()
            && id == Some(last.id)
        {
            last.reply = Some(Ok(reply));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palmares_protocol::reply::Ack;
    use palmares_protocol::request::Time;
    use palmares_protocol::{Code, Step};
    use palmares_tasks::{Action, Fault};

    fn step(tick: u64) -> Request {
        Request::Step(Step { tick, action: Action::default(), repeat: 1, cameras: Vec::new() })
    }

    fn ack(id: u64) -> Reply {
        Reply::Ack(Ack { id, tick: id })
    }

    /// Carries out a request and sends its reply.
    fn sent(answered: &mut Answered, id: u64, request: Request) {
        answered.carried_out(id, request, &Ok(ack(id)));
        answered.keep(ack(id));
    }

    #[test]
    fn only_a_client_that_is_back_gets_the_reply_again_and_as_often_as_it_asks() {
        let mut answered = Answered::default();
        sent(&mut answered, 3, step(7));
        assert!(answered.again(3, &step(7)).is_none(), "on the same connection it is a stale step");
        answered.client_is_back();
        for _ in 0..2 {
            assert!(matches!(answered.again(3, &step(7)), Some(Ok(Reply::Ack(_)))));
            answered.keep(ack(3));
        }
        sent(&mut answered, 4, step(8));
        assert!(answered.again(4, &step(8)).is_none(), "it was carried out on this connection");
    }

    #[test]
    fn another_request_or_id_is_another_request() {
        let mut answered = Answered::default();
        answered.client_is_back();
        assert!(answered.again(3, &step(7)).is_none(), "nothing was carried out yet");
        sent(&mut answered, 3, step(7));
        answered.client_is_back();
        let hand = Action { hand: Some(vec![0.5]), ..Action::default() };
        let other = Request::Step(Step { tick: 7, action: hand, repeat: 1, cameras: Vec::new() });
        for (id, request) in [(4, step(7)), (3, step(8)), (3, other)] {
            assert!(answered.again(id, &request).is_none(), "{id} {request:?}");
        }
        assert!(answered.again(3, &step(7)).is_some());
    }

    #[test]
    fn requests_that_change_nothing_leave_the_reply() {
        let mut answered = Answered::default();
        sent(&mut answered, 3, step(7));
        answered.carried_out(4, Request::Time(Time {}), &Ok(ack(4)));
        answered.carried_out(5, step(9), &Err(Refusal::new(Code::StaleTick, "")));
        answered.keep(ack(4));
        answered.client_is_back();
        assert!(matches!(answered.again(3, &step(7)), Some(Ok(Reply::Ack(Ack { id: 3, .. })))));
    }

    #[test]
    fn a_world_that_failed_is_told_again() {
        let mut answered = Answered::default();
        let refusal = Refusal::new(Code::Internal, "it failed").by(Fault::Crashed);
        answered.carried_out(3, step(7), &Err(refusal.clone()));
        answered.client_is_back();
        for _ in 0..2 {
            assert!(matches!(answered.again(3, &step(7)), Some(Err(again)) if again == refusal));
        }
    }
}
