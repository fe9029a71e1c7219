//! One control connection: reads requests one by one, answers each, and sends pings. It is a task of the runtime until its
//! session begins, then it has a thread of its own.
//!
//! The next request is read only after the last was answered, so no queue grows on the server: a client that sends faster
//! fills its own socket. A client that reads slowly misses observations of its realtime run, the oldest first, but no other
//! message. A client that reads nothing is dropped.

use super::end::ConnectionEnd;
use super::rate::RateLimit;
use crate::session::{Handover, InboxMessage, PendingCommand, Session, Sessions, changed};
use axum::body::Bytes;
use axum::extract::ws::{Message, WebSocket};
use palmares_metrics::METRICS;
use palmares_net::auth::{Auth, Identity};
use palmares_net::config::settings::{MESSAGE_BYTES, Settings};
use palmares_net::process::lifecycle::Alive;
use palmares_net::transport::low_latency::busy_poll::{BusyPoll, Incoming};
use palmares_net::transport::{Caller, ConnectionPermit, FrameError};
use palmares_protocol::encoding::Payload;
use palmares_protocol::{Code, Encoding, Parsed, Refusal, Reply, Request};
use palmares_store::Held;
use palmares_worlds::compute::STACK_BYTES;
use std::future::ready;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Duration;
use tokio::runtime::Handle;
use tokio::sync::oneshot;
use tokio::time::{Instant, MissedTickBehavior, interval_at, sleep_until, timeout};

/// A timer within this distance of the wanted moment is kept: recomputed moments differ by rounding.
const ALARM_SLACK: Duration = Duration::from_millis(2);

/// Initial buffer for a message, bytes.
const BUFFER_BYTES: usize = 1024;

/// The next message from an organizer or a new connection; never without a session.
async fn inbox_message(session: Option<&mut Session>) -> InboxMessage {
    match session {
        Some(session) => session.inbox_message(true).await,
        None => std::future::pending().await,
    }
}

/// The next connection that wants the session; never without a session.
async fn claimed(session: Option<&mut Session>) -> Handover {
    match session {
        Some(session) => session.claimed(true).await,
        None => std::future::pending().await,
    }
}

/// Returns when the session has another owner; never without a session.
async fn lost(held: Option<&Held>) {
    match held {
        Some(held) => held.lost().await,
        None => std::future::pending().await,
    }
}

fn moved() -> Refusal {
    Refusal::new(Code::Internal, "the session continues on another server; connect again")
}

struct Connection {
    socket: WebSocket,
    encoding: Encoding,
    sessions: Arc<Sessions>,
    auth: Arc<Auth>,
    /// Whose token opened the connection.
    identity: Option<Identity>,
    session: Option<Box<Session>>,
    rate: RateLimit,
    busy_poll: BusyPoll,
    /// Expected size of the next message, bytes.
    buffer_bytes: usize,
    /// When the last message of the client was handled.
    heard: Instant,
    /// When the connection closes unless a `hello` has come.
    hello_by: Instant,
    /// Why the last `hello` opened no session.
    not_greeted: Option<Refusal>,
    /// Released at the end of the connection.
    _caller: Caller,
    _permit: ConnectionPermit,
    _alive: Alive,
}

/// The parts of a new connection.
pub(super) struct ConnectionParts {
    pub(super) caller: Caller,
    pub(super) encoding: Encoding,
    pub(super) sessions: Arc<Sessions>,
    pub(super) auth: Arc<Auth>,
    /// Whose token opened it; None without a token.
    pub(super) identity: Option<Identity>,
    pub(super) permit: ConnectionPermit,
}

/// Serves a connection until its session begins, then moves it to a thread of its own.
pub(super) async fn serve(socket: WebSocket, parts: ConnectionParts) {
    let ConnectionParts { caller, encoding, sessions, auth, identity, permit } = parts;
    let (competition, lifecycle) = (&sessions.competition, &sessions.lifecycle);
    let limits = competition.limits();
    let rate = RateLimit::new(limits.requests_per_s, limits.requests_burst, lifecycle.now());
    let heard = Instant::now();
    let hello_by = heard + competition.settings.hello_timeout;
    let alive = lifecycle.alive();
    let busy_poll = caller.busy_poll(sessions.compute.scheduler.cores());
    let mut connection = Connection {
        socket,
        encoding,
        sessions,
        auth,
        identity,
        session: None,
        rate,
        busy_poll,
        buffer_bytes: BUFFER_BYTES,
        heard,
        hello_by,
        not_greeted: None,
        _caller: caller,
        _permit: permit,
        _alive: alive,
    };
    match connection.run().await {
        ConnectionEnd::Greeted => connection.move_to_a_thread().await,
        end => connection.end(end).await,
    }
}

impl Connection {
    /// Continues on a thread of its own, where the session's world is stepped: a long tick delays only its own client.
    async fn move_to_a_thread(self) {
        let (give, take) = oneshot::channel::<Connection>();
        let runtime = Handle::current();
        let body = move || {
            runtime.block_on(async move {
                let Ok(mut connection) = take.await else { return };
                let end = connection.run().await;
                connection.end(end).await;
            });
        };
        match std::thread::Builder::new().name("session".into()).stack_size(STACK_BYTES).spawn(body) {
            // The thread receives it.
            Ok(_) => drop(give.send(self)),
            Err(error) => {
                tracing::error!(%error, "cannot start a thread for a session");
                self.end(ConnectionEnd::Fatal(Code::Capacity)).await;
            }
        }
    }

    /// Parks or ends the session, then closes the socket.
    async fn end(mut self, end: ConnectionEnd) {
        let session = self.session.take();
        let (fate, socket_end) = end.decide(session.as_ref().is_some_and(|session| session.moves_on()));
        // In this order: a client that reconnects at once finds its session waiting.
        if let Some(session) = session
            && let Some((message, patience)) = fate.fulfil(session, self.settings().ping_timeout).await
        {
            let _ = timeout(patience, self.send(&message)).await;
        }
        socket_end.end(self.socket).await;
    }

    async fn run(&mut self) -> ConnectionEnd {
        let interval = self.settings().ping_interval();
        let mut ping = interval_at(Instant::now() + interval, interval);
        ping.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let sessions = self.sessions.clone();
        let stopping = sessions.lifecycle.stopping();
        tokio::pin!(stopping);
        let (auth, identity) = (self.auth.clone(), self.identity.clone());
        let revoked = auth.revoked(identity.as_ref());
        tokio::pin!(revoked);
        // Reset only when the moment has changed, not for every message.
        let alarm = sleep_until(Instant::now());
        tokio::pin!(alarm);
        let mut armed = false;
        loop {
            let change = match &self.session {
                Some(session) => session.next_change(),
                None => Some(self.hello_by.saturating_duration_since(Instant::now())),
            };
            match change {
                Some(change) => {
                    let moment = Instant::now() + change;
                    let off = moment.saturating_duration_since(alarm.deadline())
                        + alarm.deadline().saturating_duration_since(moment);
                    if !armed || off > ALARM_SLACK {
                        alarm.as_mut().reset(moment);
                    }
                    armed = true;
                }
                None => armed = false,
            }
            let found = self.busy_poll().await;
            let busy = found.is_some();
            if let Some(message) = found
                && let ControlFlow::Break(end) = self.receive(message).await
            {
                return end;
            }
            if self.busy_poll.continues(busy) {
                continue;
            }
            let live = self.session.as_ref().and_then(|session| session.stream().cloned());
            let held = self.session.as_ref().map(|session| session.held().clone());
            let flow = tokio::select! {
                biased;
                () = lost(held.as_ref()) => return ConnectionEnd::Moved,
                () = &mut stopping => return ConnectionEnd::Stopping,
                () = &mut revoked => {
                    let refusal = Refusal::new(Code::NotAuthorized, "the token was revoked").fatal();
                    self.refuse(None, &refusal).await
                }
                _ = ping.tick() => self.ping().await,
                () = &mut alarm, if armed => {
                    armed = false;
                    self.expire().await
                }
                message = inbox_message(self.session.as_deref_mut()) => match message {
                    InboxMessage::Command(command) => self.execute(command).await,
                    InboxMessage::Claim(to) => ControlFlow::Break(ConnectionEnd::Replaced(to)),
                },
                // Busy polling registers no waker.
                message = self.socket.recv(), if !busy => self.receive(message).await,
                () = changed(live.as_deref()) => self.stream().await,
                () = ready(()), if busy => ControlFlow::Continue(()),
            };
            if let ControlFlow::Break(end) = flow {
                return end;
            }
        }
    }

    fn settings(&self) -> &Settings {
        &self.sessions.competition.settings
    }

    /// Polls for the next request before the thread sleeps.
    async fn busy_poll(&mut self) -> Option<Incoming> {
        let (scheduler, lifecycle) = (&self.sessions.compute.scheduler, &self.sessions.lifecycle);
        let idle = || scheduler.is_idle() && !lifecycle.is_stopping();
        // The client of a realtime world waits for ticks too, not for the socket alone.
        let may_block = self.session.as_ref().is_some_and(|session| session.stream().is_none());
        self.busy_poll.next(&mut self.socket, idle, may_block).await
    }

    /// Sends the next observation of a realtime world, or closes its run.
    async fn stream(&mut self) -> ControlFlow<ConnectionEnd> {
        let Some(session) = &mut self.session else { return ControlFlow::Continue(()) };
        // One at a time, so that requests are handled in between.
        if let Some(obs) = session.next_streamed().await {
            self.send(&obs).await?;
        }
        let Some(session) = &mut self.session else { return ControlFlow::Continue(()) };
        session.close_if_world_over().await;
        if let Some(live) = session.stream() {
            live.renotify();
        }
        ControlFlow::Continue(())
    }

    /// Executes an organizer's command.
    async fn execute(&mut self, command: PendingCommand) -> ControlFlow<ConnectionEnd> {
        let Some(session) = &mut self.session else { return ControlFlow::Continue(()) };
        let (over, reply) = session.execute(command).await;
        if let Some(reply) = reply {
            self.send(&reply).await?;
        }
        if over { ControlFlow::Break(ConnectionEnd::Ended) } else { ControlFlow::Continue(()) }
    }

    async fn ping(&mut self) -> ControlFlow<ConnectionEnd> {
        if self.heard.elapsed() >= self.settings().ping_timeout {
            tracing::info!("the client is silent; connection dropped");
            return ControlFlow::Break(ConnectionEnd::Lost);
        }
        self.send_message(Message::Ping(Bytes::new())).await
    }

    /// Handles a mark or the end of the session's clock, or a `hello` that has not come in time.
    async fn expire(&mut self) -> ControlFlow<ConnectionEnd> {
        let Some(session) = &mut self.session else {
            let seconds = self.settings().hello_timeout.as_secs_f64();
            let late = match self.not_greeted.take() {
                Some(why) => {
                    Refusal::new(why.code, format!("no session within {seconds} s: {}", why.message))
                }
                None => Refusal::new(Code::TooSlow, format!("no hello within {seconds} s")),
            };
            return self.refuse(None, &late.fatal()).await;
        };
        match session.expire().await {
            Some(warning) => self.send(&warning).await,
            None => ControlFlow::Continue(()),
        }
    }

    /// Sends the warning for a mark that has been passed.
    async fn warn(&mut self) -> ControlFlow<ConnectionEnd> {
        match self.session.as_mut().and_then(|session| session.warning()) {
            Some(warning) => self.send(&warning).await,
            None => ControlFlow::Continue(()),
        }
    }

    async fn receive(&mut self, message: Incoming) -> ControlFlow<ConnectionEnd> {
        let flow = match message {
            None => ControlFlow::Break(ConnectionEnd::Lost),
            Some(Ok(Message::Close(_))) => ControlFlow::Break(ConnectionEnd::Closed),
            Some(Err(error)) => match FrameError::of(&error) {
                // The limit of the WebSocket library, above which a message is not read.
                FrameError::TooLarge => self.too_large().await,
                FrameError::Violation(code, reason) => {
                    tracing::debug!(code, reason, "the client broke the WebSocket protocol");
                    ControlFlow::Break(ConnectionEnd::Violation(code, reason))
                }
                FrameError::Lost => {
                    tracing::debug!(%error, "connection failed");
                    ControlFlow::Break(ConnectionEnd::Lost)
                }
            },
            Some(Ok(Message::Ping(_) | Message::Pong(_))) => ControlFlow::Continue(()),
            Some(Ok(Message::Text(text))) if text.len() > MESSAGE_BYTES => self.too_large().await,
            Some(Ok(Message::Binary(bytes))) if bytes.len() > MESSAGE_BYTES => self.too_large().await,
            Some(Ok(Message::Text(text))) => self.answer(|encoding| encoding.read_text(&text)).await,
            Some(Ok(Message::Binary(bytes))) => self.answer(|encoding| encoding.read_binary(&bytes)).await,
        };
        // After the answer: the connection reads nothing while the world computes.
        self.heard = Instant::now();
        flow
    }

    async fn too_large(&mut self) -> ControlFlow<ConnectionEnd> {
        let message = format!("a message may have at most {MESSAGE_BYTES} bytes");
        self.refuse(None, &Refusal::new(Code::TooLarge, message).fatal()).await
    }

    async fn refuse(&mut self, id: Option<u64>, refusal: &Refusal) -> ControlFlow<ConnectionEnd> {
        METRICS.refused(refusal.code);
        tracing::debug!(code = refusal.code.name(), why = refusal.message, "request refused");
        self.send(&Reply::refused(id, refusal)).await?;
        if refusal.fatal {
            ControlFlow::Break(ConnectionEnd::Fatal(refusal.code))
        } else {
            ControlFlow::Continue(())
        }
    }

    /// Answers one frame, decoded by `read`.
    async fn answer(&mut self, read: impl FnOnce(Encoding) -> Parsed) -> ControlFlow<ConnectionEnd> {
        self.busy_poll.received();
        let Parsed { id, request } = read(self.encoding);
        if let Err(wait_s) = self.rate.take(self.sessions.lifecycle.now()) {
            let message = format!("more than {} requests per second", self.settings().requests_per_s);
            return self.refuse(id, &Refusal::new(Code::RateLimited, message).retry_after(wait_s)).await;
        }
        let (id, request) = match (id, request) {
            (Some(id), Ok(Request::Bye(_))) => {
                tracing::debug!(id, "bye");
                return ControlFlow::Break(ConnectionEnd::Bye);
            }
            (Some(id), Ok(request)) => (id, request),
            (id, Err(refusal)) => return self.refuse(id, &refusal).await,
            // The parser returns no request without an id.
            (None, Ok(_)) => return ControlFlow::Continue(()),
        };
        let greeted = matches!(request, Request::Hello(_));
        match self.carry_out(id, request).await {
            Ok(reply) => {
                // The warning for a mark that the simulated time has passed comes before the reply.
                let mut sent = self.warn().await;
                if sent.is_continue() {
                    sent = self.send(&reply).await;
                }
                if let Some(session) = &mut self.session {
                    session.keep(reply);
                }
                sent?;
                self.busy_poll.replied();
                if greeted {
                    return ControlFlow::Break(ConnectionEnd::Greeted);
                }
                if let Some(session) = &mut self.session {
                    session.after_reply();
                }
                ControlFlow::Continue(())
            }
            // Without an answer: the next owner gives it.
            Err(_) if self.session.as_ref().is_some_and(|session| session.held().is_lost()) => {
                ControlFlow::Break(ConnectionEnd::Moved)
            }
            Err(refusal) => self.refuse(Some(id), &refusal).await,
        }
    }

    async fn carry_out(&mut self, id: u64, request: Request) -> Result<Reply, Refusal> {
        match (&mut self.session, request) {
            (Some(session), request) => {
                let held = session.held().clone();
                tokio::select! {
                    biased;
                    // The answer may wait for a database that does not answer: nobody needs it any more.
                    () = held.lost() => Err(moved()),
                    answer = session.answer(id, request) => answer,
                }
            }
            (None, Request::Hello(hello)) => {
                let greeted = self.sessions.greet(&hello, self.identity.as_ref()).await;
                let mut session = greeted.inspect_err(|why| self.not_greeted = Some(why.clone()))?;
                let welcome = session.welcome(id).await;
                self.session = Some(session);
                Ok(welcome)
            }
            (None, request) => {
                Err(Refusal::new(Code::WrongState, format!("send hello before {}", request.op())))
            }
        }
    }

    async fn send(&mut self, reply: &Reply) -> ControlFlow<ConnectionEnd> {
        let (length, message) = match self.encoding.write(reply, self.buffer_bytes) {
            Ok(Payload::Text(text)) => (text.len(), Message::Text(text.into())),
            Ok(Payload::Binary(bytes)) => (bytes.len(), Message::Binary(bytes.into())),
            Err(error) => {
                tracing::error!(%error, "a reply cannot be encoded");
                return ControlFlow::Break(ConnectionEnd::Fatal(Code::Internal));
            }
        };
        // Most messages are about as long as the one before.
        self.buffer_bytes = length.clamp(BUFFER_BYTES, 16 * BUFFER_BYTES) * 5 / 4;
        self.send_message(message).await
    }

    async fn send_message(&mut self, message: Message) -> ControlFlow<ConnectionEnd> {
        let limit = self.settings().ping_timeout;
        tokio::select! {
            biased;
            sent = timeout(limit, self.socket.send(message)) => match sent {
                Ok(Ok(())) => ControlFlow::Continue(()),
                Ok(Err(_)) | Err(_) => ControlFlow::Break(ConnectionEnd::Lost),
            },
            // The old socket does not take the message: its client is on another one already.
            to = claimed(self.session.as_deref_mut()) => ControlFlow::Break(ConnectionEnd::Replaced(to)),
        }
    }
}
