//! One control connection: reads requests one by one, answers each, keeps the heart beating. Until its session begins
//! it is a task among others, then it has a thread of its own.
//!
//! The next request is read only after the last was answered, so nothing queues up on the server; a client
//! that sends faster fills its own socket. A client that reads slowly misses observations of its realtime run, the
//! oldest first, but no other message; one that takes nothing at all is dropped.

use super::rate::RateLimit;
use crate::auth::{Auth, Identity};
use crate::compute::STACK;
use crate::config::settings::{MESSAGE_BYTES, Settings};
use crate::lifecycle::Alive;
use crate::metrics::METRICS;
use crate::session::{PendingCommand, Session, Sessions, news};
use crate::transport::low_latency::busy_poll::{BusyPoll, Incoming};
use crate::transport::{Caller, ConnectionPermit, farewell};
use axum::body::Bytes;
use axum::extract::ws::{Message, WebSocket};
use palmares_protocol::encoding::Payload;
use palmares_protocol::{Code, Encoding, Parsed, Refusal, Reply, Request};
use palmares_tasks::Reason;
use std::future::ready;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Duration;
use tokio::runtime::Handle;
use tokio::sync::oneshot;
use tokio::time::{Instant, MissedTickBehavior, interval_at, sleep_until, timeout};

/// Normal closure, RFC 6455.
const CLOSE_NORMAL: u16 = 1000;
/// The server is going away, RFC 6455.
const CLOSE_AWAY: u16 = 1001;

/// Why a connection ends, or goes on elsewhere.
enum End {
    /// A session has begun.
    Greeted,
    /// The client is gone.
    Lost,
    /// The client said `bye`.
    Bye,
    /// A fatal error; the client was told.
    Fatal(Code),
    /// The server shuts down.
    Stopping,
    /// An organizer ended the session.
    Ended,
}

/// An alarm that is off by less is left as it is: clocks that run at the same rate differ by a rounding.
const ALARM_SLACK: Duration = Duration::from_millis(2);

/// Bytes set aside for a message of which nothing is known.
const ROOM: usize = 1024;

async fn command(session: Option<&mut Session>) -> PendingCommand {
    match session {
        Some(session) => session.command().await,
        None => std::future::pending().await,
    }
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
    /// Bytes the next message will probably need.
    room: usize,
    /// When the client last showed a sign of life.
    heard: Instant,
    /// When the connection closes unless it has said hello.
    hello_by: Instant,
    /// Given back when the connection is gone.
    _caller: Caller,
    _permit: ConnectionPermit,
    _alive: Alive,
}

/// What a connection begins with.
pub(super) struct Parts {
    pub(super) caller: Caller,
    pub(super) encoding: Encoding,
    pub(super) sessions: Arc<Sessions>,
    pub(super) auth: Arc<Auth>,
    /// Whose token opened it.
    pub(super) identity: Option<Identity>,
    pub(super) permit: ConnectionPermit,
}

/// Serves a connection until its session begins, and sees to it that it is served until it ends.
pub(super) async fn serve(socket: WebSocket, parts: Parts) {
    let Parts { caller, encoding, sessions, auth, identity, permit } = parts;
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
        room: ROOM,
        heard,
        hello_by,
        _caller: caller,
        _permit: permit,
        _alive: alive,
    };
    match connection.talk().await {
        End::Greeted => connection.move_to_a_thread().await,
        end => connection.end(end).await,
    }
}

impl Connection {
    /// Goes on on a thread of its own. There the session's world is stepped: however long it computes, it keeps nobody
    /// waiting but its own client.
    async fn move_to_a_thread(self) {
        let (give, take) = oneshot::channel::<Connection>();
        let runtime = Handle::current();
        let body = move || {
            runtime.block_on(async move {
                let Ok(mut connection) = take.await else { return };
                let end = connection.talk().await;
                connection.end(end).await;
            });
        };
        match std::thread::Builder::new().name("session".into()).stack_size(STACK).spawn(body) {
            // The thread waits for it.
            Ok(_) => drop(give.send(self)),
            Err(error) => {
                tracing::error!(%error, "no thread for a session");
                self.end(End::Fatal(Code::Capacity)).await;
            }
        }
    }

    /// Leaves the session in order, and says goodbye.
    async fn end(mut self, end: End) {
        let session = self.session.take();
        // The session is settled before the socket closes: a client that comes back at once finds it waiting.
        match end {
            End::Greeted => {}
            End::Lost => {
                if let Some(session) = session {
                    session.park();
                }
            }
            End::Fatal(code) => {
                if let Some(session) = session {
                    session.park();
                }
                farewell(self.socket, code.close_code(), code.name()).await;
            }
            End::Bye => {
                if let Some(session) = session {
                    session.leave().await;
                }
                farewell(self.socket, CLOSE_NORMAL, "bye").await;
            }
            End::Ended => {
                if let Some(session) = session {
                    session.end(Reason::Stopped, None).await;
                }
                farewell(self.socket, CLOSE_NORMAL, "session_over").await;
            }
            End::Stopping => {
                if let Some(session) = session
                    && let Some(result) = session.end(Reason::Stopped, Some("the server shut down")).await
                {
                    // The client may be gone; the result is stored.
                    let _ = self.send(&result).await;
                }
                farewell(self.socket, CLOSE_AWAY, "server_shutdown").await;
            }
        }
    }

    async fn talk(&mut self) -> End {
        let interval = self.settings().ping_interval();
        let mut ping = interval_at(Instant::now() + interval, interval);
        ping.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let sessions = self.sessions.clone();
        let stopping = sessions.lifecycle.stopping();
        tokio::pin!(stopping);
        let (auth, identity) = (self.auth.clone(), self.identity.clone());
        let revoked = auth.revoked(identity.as_ref());
        tokio::pin!(revoked);
        // Set anew only when the moment has changed, not for every message.
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
            if self.busy_poll.goes_on(busy) {
                continue;
            }
            let live = self.session.as_ref().and_then(|session| session.stream().cloned());
            let flow = tokio::select! {
                biased;
                () = &mut stopping => return End::Stopping,
                () = &mut revoked => {
                    let refusal = Refusal::new(Code::NotAuthorized, "the token was revoked").fatal();
                    self.refuse(None, &refusal).await
                }
                _ = ping.tick() => self.beat().await,
                () = &mut alarm, if armed => {
                    armed = false;
                    self.expire().await
                }
                command = command(self.session.as_deref_mut()) => self.obey(command).await,
                // While busy-polling, do not register the waker.
                message = self.socket.recv(), if !busy => self.receive(message).await,
                () = news(live.as_deref()) => self.stream().await,
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

    /// Looks for the next request before going to sleep.
    async fn busy_poll(&mut self) -> Option<Incoming> {
        let (scheduler, lifecycle) = (&self.sessions.compute.scheduler, &self.sessions.lifecycle);
        let idle = || scheduler.is_idle() && !lifecycle.is_stopping();
        // Who is told of a realtime world's ticks must not sleep on the socket alone.
        let may_doze = self.session.as_ref().is_some_and(|session| session.stream().is_none());
        self.busy_poll.next(&mut self.socket, idle, may_doze).await
    }

    /// A realtime world has something to tell.
    async fn stream(&mut self) -> ControlFlow<End> {
        let Some(session) = &mut self.session else { return ControlFlow::Continue(()) };
        // One at a time: requests must have their turn in between.
        if let Some(obs) = session.streamed().await {
            self.send(&obs).await?;
        }
        let Some(session) = &mut self.session else { return ControlFlow::Continue(()) };
        session.close_if_played_out().await;
        if let Some(live) = session.stream() {
            live.remind();
        }
        ControlFlow::Continue(())
    }

    /// An organizer asks something of the session.
    async fn obey(&mut self, command: PendingCommand) -> ControlFlow<End> {
        let Some(session) = &mut self.session else { return ControlFlow::Continue(()) };
        let (over, told) = session.obey(command).await;
        if let Some(told) = told {
            self.send(&told).await?;
        }
        if over { ControlFlow::Break(End::Ended) } else { ControlFlow::Continue(()) }
    }

    async fn beat(&mut self) -> ControlFlow<End> {
        if self.heard.elapsed() >= self.settings().ping_timeout {
            tracing::info!("no sign of life; connection dropped");
            return ControlFlow::Break(End::Lost);
        }
        self.send_message(Message::Ping(Bytes::new())).await
    }

    /// The session's clock has passed a mark or its end; or no session has begun in time.
    async fn expire(&mut self) -> ControlFlow<End> {
        let Some(session) = &mut self.session else {
            let seconds = self.settings().hello_timeout.as_secs_f64();
            let message = format!("no session has begun within {seconds} s; say hello sooner");
            return self.refuse(None, &Refusal::new(Code::TooSlow, message).fatal()).await;
        };
        match session.expire().await {
            Some(warning) => self.send(&warning).await,
            None => ControlFlow::Continue(()),
        }
    }

    /// Announces a mark that has been passed.
    async fn warn(&mut self) -> ControlFlow<End> {
        match self.session.as_mut().and_then(|session| session.warning()) {
            Some(warning) => self.send(&warning).await,
            None => ControlFlow::Continue(()),
        }
    }

    async fn receive(&mut self, message: Incoming) -> ControlFlow<End> {
        let flow = match message {
            None | Some(Ok(Message::Close(_))) => ControlFlow::Break(End::Lost),
            // The WebSocket layer's own limit; its error has no type we could name.
            Some(Err(error)) if error.to_string().contains("too long") => self.too_large().await,
            Some(Err(error)) => {
                tracing::debug!(%error, "connection failed");
                ControlFlow::Break(End::Lost)
            }
            Some(Ok(Message::Ping(_) | Message::Pong(_))) => ControlFlow::Continue(()),
            Some(Ok(Message::Text(text))) if text.len() > MESSAGE_BYTES => self.too_large().await,
            Some(Ok(Message::Binary(bytes))) if bytes.len() > MESSAGE_BYTES => self.too_large().await,
            Some(Ok(Message::Text(text))) => self.answer(|encoding| encoding.read_text(&text)).await,
            Some(Ok(Message::Binary(bytes))) => self.answer(|encoding| encoding.read_binary(&bytes)).await,
        };
        // After the answer, not before: while the world computes, nobody listens for signs of life.
        self.heard = Instant::now();
        flow
    }

    async fn too_large(&mut self) -> ControlFlow<End> {
        let message = format!("a message may have at most {MESSAGE_BYTES} bytes");
        self.refuse(None, &Refusal::new(Code::TooLarge, message).fatal()).await
    }

    async fn refuse(&mut self, id: Option<u64>, refusal: &Refusal) -> ControlFlow<End> {
        METRICS.refused(refusal.code);
        tracing::debug!(code = refusal.code.name(), why = refusal.message, "request refused");
        self.send(&Reply::refused(id, refusal)).await?;
        if refusal.fatal { ControlFlow::Break(End::Fatal(refusal.code)) } else { ControlFlow::Continue(()) }
    }

    /// Answers one frame, which `read` reads.
    async fn answer(&mut self, read: impl FnOnce(Encoding) -> Parsed) -> ControlFlow<End> {
        self.busy_poll.asked();
        let Parsed { id, request } = read(self.encoding);
        if let Err(wait_s) = self.rate.take(self.sessions.lifecycle.now()) {
            let message = format!("more than {} requests per second", self.settings().requests_per_s);
            return self.refuse(id, &Refusal::new(Code::RateLimited, message).retry_after(wait_s)).await;
        }
        let (id, request) = match (id, request) {
            (Some(id), Ok(Request::Bye(_))) => {
                tracing::debug!(id, "bye");
                return ControlFlow::Break(End::Bye);
            }
            (Some(id), Ok(request)) => (id, request),
            (id, Err(refusal)) => return self.refuse(id, &refusal).await,
            // The parser gives no request without an id.
            (None, Ok(_)) => return ControlFlow::Continue(()),
        };
        let greeted = matches!(request, Request::Hello(_));
        match self.carry_out(id, request).await {
            Ok(reply) => {
                // A mark passed by simulating is announced before the reply that passed it.
                self.warn().await?;
                self.send(&reply).await?;
                self.busy_poll.replied();
                if greeted {
                    return ControlFlow::Break(End::Greeted);
                }
                if let Some(session) = &mut self.session {
                    session.answered();
                }
                ControlFlow::Continue(())
            }
            Err(refusal) => self.refuse(Some(id), &refusal).await,
        }
    }

    async fn carry_out(&mut self, id: u64, request: Request) -> Result<Reply, Refusal> {
        match (&mut self.session, request) {
            (Some(session), request) => session.answer(id, request).await,
            (None, Request::Hello(hello)) => {
                let mut session = self.sessions.greet(&hello, self.identity.as_ref()).await?;
                let welcome = session.welcome(id).await;
                self.session = Some(session);
                Ok(welcome)
            }
            (None, request) => {
                Err(Refusal::new(Code::WrongState, format!("say hello before {}", request.op())))
            }
        }
    }

    async fn send(&mut self, reply: &Reply) -> ControlFlow<End> {
        let (length, message) = match self.encoding.write(reply, self.room) {
            Ok(Payload::Text(text)) => (text.len(), Message::Text(text.into())),
            Ok(Payload::Binary(bytes)) => (bytes.len(), Message::Binary(bytes.into())),
            Err(error) => {
                tracing::error!(%error, "a reply cannot be written");
                return ControlFlow::Break(End::Fatal(Code::Internal));
            }
        };
        // The next message will be about as long as this one, at most.
        self.room = length.clamp(ROOM, 16 * ROOM) * 5 / 4;
        self.send_message(message).await
    }

    async fn send_message(&mut self, message: Message) -> ControlFlow<End> {
        match timeout(self.settings().ping_timeout, self.socket.send(message)).await {
            Ok(Ok(())) => ControlFlow::Continue(()),
            Ok(Err(_)) | Err(_) => ControlFlow::Break(End::Lost),
        }
    }
}
