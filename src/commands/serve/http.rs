//! HTTP in front of the service: one thread moves bytes, another answers requests in turn.

use std::fmt::Display;
use std::net::{IpAddr, SocketAddr, TcpListener, ToSocketAddrs as _};
use std::path::Path;
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use http_body_util::{BodyExt as _, Either, Full};
use hyper::body::{Body as _, Bytes, Incoming};
use hyper::header::{
    ALLOW, AUTHORIZATION, CACHE_CONTROL, CONTENT_TYPE, HOST, HeaderMap, RETRY_AFTER,
    WWW_AUTHENTICATE,
};
use hyper::http::HeaderValue;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper::{Method, Request, Response, StatusCode};
use hyper_util::rt::{TokioIo, TokioTimer};
use serde_json::json;
use service::message::{Answer as Told, Code, MOST_BYTES, PROTOCOL};
use sha2::{Digest as _, Sha256};
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpStream;
use tokio::sync::{Semaphore, oneshot, watch};
use tokio::task::JoinSet;
use tokio::time::{timeout, timeout_at};
use tokio_io_timeout::TimeoutStream;

use super::connections::{Place, Places};
use super::events::{Events, Feed};
use super::journaled::{Done, JournaledService};
use super::{figures, text_of};
use crate::io::answer::Answer;
use crate::io::failure::Failure;
use crate::io::files;

/// Longest time for the head of a request, and between two on one connection. Chosen here: a
/// hundred round trips on a bad link.
const HEAD: Duration = Duration::from_secs(10);
/// Longest time for a body. Chosen here: the largest at 5 MB/s.
const BODY: Duration = Duration::from_secs(60);
/// Longest time in which nothing of an answer is taken: as for a head.
const STALLED: Duration = Duration::from_secs(10);
/// Most bytes of a head. Chosen here: eight times what browsers send.
const MOST_HEAD_BYTES: usize = 64 << 10;
/// Most bytes of all bodies that are held at once: two of the largest.
const MOST_HELD_BYTES: usize = 2 * MOST_BYTES;
/// How long the request that is worked on may go on when the process is to end. Chosen here: a
/// tenth of what systemd waits.
const GRACE: Duration = Duration::from_secs(9);
/// And what the request that is worked on gets of it, however long others took: chosen here.
const LEAST_GRACE: Duration = Duration::from_secs(1);
/// How long what a connection sends is read that is turned away, and how many are read from at a
/// time: chosen here, a small request on a bad link.
const TURNED_AWAY: Duration = Duration::from_secs(1);
const MOST_TURNED_AWAY: usize = 64;
/// Fewest characters of a token. Chosen here: 64 bits in hexadecimal digits.
const FEWEST_TOKEN_CHARS: usize = 16;
/// Most bytes of a file with a token.
const MOST_TOKEN_BYTES: u64 = 4096;
/// Exit code of a process ended by a second interrupt: 128 + SIGINT, as shells have it.
const ENDED: i32 = 130;

/// A body that is whole, or goes on.
type Payload = Either<Full<Bytes>, Feed>;

/// An open port.
pub(super) struct HttpListener {
    listener: TcpListener,
    address: SocketAddr,
    /// SHA-256 of the token: digests differ anywhere, so that how long they take to compare says
    /// nothing about the token.
    token: Option<[u8; 32]>,
    most_waiting: u32,
    most_connections: u32,
}

/// What all connections share.
struct ConnectionContext {
    token: Option<[u8; 32]>,
    jobs: mpsc::Sender<Job>,
    waiting: Arc<Places>,
    connections: Arc<Places>,
    held_bytes: Arc<AtomicUsize>,
    figures: Arc<figures::Figures>,
    events: Arc<Events>,
    stopping: Arc<AtomicBool>,
}

/// A request for the service.
struct Job {
    line: String,
    came: Instant,
    reply: oneshot::Sender<(Option<Code>, Bytes)>,
    /// Until it is answered.
    _room: (Place, Held),
}

/// Why a request does not reach the service.
struct Refused(Code, String);

impl Refused {
    fn new(code: Code, message: impl Into<String>) -> Refused {
        Refused(code, message.into())
    }
}

impl HttpListener {
    /// Listens at an address; others than this machine's own need a token.
    pub(super) fn open(
        address: &str,
        token_file: Option<&Path>,
        (most_waiting, most_connections): (u32, u32),
    ) -> Result<HttpListener, Failure> {
        let failed = |source| Failure::Listen {
            address: address.to_owned(),
            source,
        };
        let token = token_file.map(token_of).transpose()?;
        let found: Vec<SocketAddr> = address.to_socket_addrs().map_err(failed)?.collect();
        if let Some(open) = found.iter().find(|it| !it.ip().is_loopback())
            && token.is_none()
        {
            return Err(Failure::Unguarded(*open));
        }
        let listener = TcpListener::bind(&found[..]).map_err(failed)?;
        listener.set_nonblocking(true).map_err(failed)?;
        Ok(HttpListener {
            address: listener.local_addr().map_err(failed)?,
            listener,
            token,
            most_waiting,
            most_connections,
        })
    }

    /// Answers until the process is told to end, or the journal cannot be written.
    pub(super) fn serve(self, mut service: JournaledService) -> Result<Answer, Failure> {
        let log = service.log();
        let figures = Arc::new(figures::Figures::new());
        let events = Arc::new(Events::default());
        for (line, event) in service.take_replayed() {
            events.publish(&line, &event);
        }
        let stopping = Arc::new(AtomicBool::new(false));
        let (stop, stopped) = watch::channel(false);
        let is_stopping = Arc::clone(&stopping);
        let _ = ctrlc::set_handler(move || {
            if is_stopping.swap(true, Ordering::SeqCst) {
                std::process::exit(ENDED);
            }
            stop.send_replace(true);
        });
        let (jobs, queue) = mpsc::channel();
        let context = Arc::new(ConnectionContext {
            token: self.token,
            jobs,
            waiting: Places::new(self.most_waiting),
            connections: Places::new(self.most_connections),
            held_bytes: Arc::default(),
            figures: Arc::clone(&figures),
            events: Arc::clone(&events),
            stopping: Arc::clone(&stopping),
        });
        let failed = |source| Failure::Listen {
            address: self.address.to_string(),
            source,
        };
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .map_err(failed)?;
        let (alive, mut ended) = oneshot::channel::<()>();
        let worker = std::thread::spawn(move || {
            let _alive = alive;
            work(service, &queue, (&figures, &events, &stopping))
        });
        let listening = format!("http://{}", self.address);
        let words = format!("listening at {listening}");
        log.tell(words, "listening", &[("address", listening.into())]);
        runtime
            .block_on(accept(self.listener, context, stopped, &mut ended))
            .map_err(failed)?;
        if ended.try_recv() == Err(oneshot::error::TryRecvError::Empty) {
            let words = "ended before the request that was worked on; it is not in the plan";
            log.tell(words, "cut_short", &[]);
            return Ok(Answer::Yes);
        }
        match worker.join() {
            Ok(service) => service?.tell_patches(),
            Err(panic) => std::panic::resume_unwind(panic),
        }
        Ok(Answer::Yes)
    }
}

fn token_of(path: &Path) -> Result<[u8; 32], Failure> {
    let text = files::text(path, MOST_TOKEN_BYTES).map_err(Failure::read(path))?;
    let token = text.trim();
    if token.len() < FEWEST_TOKEN_CHARS || !token.bytes().all(|it| it.is_ascii_graphic()) {
        return Err(Failure::Token {
            path: path.to_owned(),
            reason: format!(
                "a token has at least {FEWEST_TOKEN_CHARS} characters, none of them blank; `openssl rand -hex 32` makes one"
            ),
        });
    }
    Ok(Sha256::digest(token).into())
}

/// Answers one request after the other, until there is no connection left that could ask.
fn work(
    mut service: JournaledService,
    queue: &mpsc::Receiver<Job>,
    (figures, events, stopping): (&figures::Figures, &Events, &AtomicBool),
) -> Result<JournaledService, Failure> {
    let tell = |service: &JournaledService| {
        let revision = service.revision().unwrap_or(0);
        figures.revision.set(revision as i64);
        figures.drones.set(service.drones() as i64);
    };
    tell(&service);
    for job in queue {
        // No client would read the answer.
        if job.reply.is_closed() {
            continue;
        }
        if stopping.load(Ordering::SeqCst) {
            let answer = Told::refused(Code::Stopping, STOPPING);
            figures.answered("none", &Code::Stopping.name());
            let _ = job.reply.send((Some(Code::Stopping), bytes_of(&answer)));
            continue;
        }
        let Done {
            answer,
            method,
            patch,
            kept,
        } = service.answer(&job.line, job.came)?;
        tell(&service);
        if let Some((line, event)) = kept {
            figures.dropped.inc_by(events.publish(&line, &event));
        }
        if let Some(took) = patch {
            figures.patched(took);
        }
        let code = answer.error.as_ref().map(|it| it.code);
        figures.answered(method, &code.map_or("ok".to_owned(), Code::name));
        // A client that has gone does not read what is in the plan.
        let _ = job.reply.send((code, bytes_of(&answer)));
    }
    Ok(service)
}

const STOPPING: &str = "the process is about to end";

fn bytes_of(answer: &Told) -> Bytes {
    let mut text = serde_json::to_vec(answer).unwrap_or_default();
    text.push(b'\n');
    Bytes::from(text)
}

/// Takes connections until the process is to end, then lets go of them.
async fn accept(
    listener: TcpListener,
    context: Arc<ConnectionContext>,
    mut stopped: watch::Receiver<bool>,
    ended: &mut oneshot::Receiver<()>,
) -> std::io::Result<()> {
    let listener = tokio::net::TcpListener::from_std(listener)?;
    let mut all = JoinSet::new();
    let turning = Arc::new(Semaphore::new(MOST_TURNED_AWAY));
    loop {
        let (stream, peer) = tokio::select! {
            _ = stopped.wait_for(|it| *it) => break,
            _ = &mut *ended => return Ok(()),
            Some(_) = all.join_next() => continue,
            accepted = listener.accept() => match accepted {
                Ok(accepted) => accepted,
                // As when there are no file descriptors left: those that are open will end.
                Err(_) => {
                    tokio::time::sleep(Duration::from_millis(100)).await;
                    continue;
                }
            },
        };
        let Some(place) = context.connections.take(peer.ip()) else {
            context.figures.answered("none", &Code::Busy.name());
            let turned = turned_away(stream);
            if let Ok(permit) = Arc::clone(&turning).try_acquire_owned() {
                all.spawn(async move {
                    turned.await;
                    drop(permit);
                });
            }
            continue;
        };
        let context = Arc::clone(&context);
        all.spawn(connection(
            context,
            stream,
            place,
            peer.ip(),
            stopped.clone(),
        ));
    }
    drop(listener);
    context.events.end();
    let until = tokio::time::Instant::now() + GRACE;
    let _ = timeout_at(until, async { while all.join_next().await.is_some() {} }).await;
    all.shutdown().await;
    // The service has ended once no connection can ask it any more.
    drop(context);
    let until = until.max(tokio::time::Instant::now() + LEAST_GRACE);
    let _ = timeout_at(until, ended).await;
    Ok(())
}

/// Tells a connection for which there is no place so. What it sends is read for a while: unread
/// bytes reset it before its end sees the answer.
async fn turned_away(mut stream: TcpStream) {
    let body = bytes_of(&Told::refused(Code::Busy, "too many connections"));
    let head = format!(
        "HTTP/1.1 429 Too Many Requests\r\ncontent-type: application/json\r\n\
         content-length: {}\r\nretry-after: 1\r\nconnection: close\r\n\r\n",
        body.len()
    );
    let told = async {
        stream.write_all(&[head.as_bytes(), &body].concat()).await?;
        stream.shutdown().await?;
        let mut sent = stream.take(MOST_BYTES as u64);
        tokio::io::copy(&mut sent, &mut tokio::io::sink()).await
    };
    let _ = timeout(TURNED_AWAY, told).await;
}

/// One connection, to its end.
async fn connection(
    context: Arc<ConnectionContext>,
    stream: TcpStream,
    _place: Place,
    peer: IpAddr,
    mut stopped: watch::Receiver<bool>,
) {
    let _ = stream.set_nodelay(true);
    let mut stream = TimeoutStream::new(stream);
    stream.set_write_timeout(Some(STALLED));
    let service = service_fn(|request| {
        let context = Arc::clone(&context);
        async move { Ok::<_, std::convert::Infallible>(context.answer(peer, request).await) }
    });
    let mut settings = http1::Builder::new();
    settings
        .timer(TokioTimer::new())
        .header_read_timeout(HEAD)
        .max_buf_size(MOST_HEAD_BYTES);
    let io = TokioIo::new(Box::pin(stream));
    let mut connection = pin!(settings.serve_connection(io, service));
    // What fails here has failed for this client alone, which knows.
    tokio::select! {
        _ = connection.as_mut() => {}
        // The guard of what is waited for must not be held.
        () = async { let _ = stopped.wait_for(|it| *it).await; } => {
            connection.as_mut().graceful_shutdown();
            let _ = connection.await;
        }
    }
}

impl ConnectionContext {
    async fn answer(&self, peer: IpAddr, request: Request<Incoming>) -> Response<Payload> {
        let path = request.uri().path();
        let method = PATHS.into_iter().find(|(known, _)| *known == path);
        let answered = self.routed(peer, request).await;
        answered.unwrap_or_else(|Refused(code, message)| {
            self.figures.answered("none", &code.name());
            let mut response = said(Some(code), bytes_of(&Told::refused(code, message)));
            if let (Code::HttpMethod, Some((_, method))) = (code, method)
                && let Ok(method) = HeaderValue::from_str(method.as_str())
            {
                response.headers_mut().insert(ALLOW, method);
            }
            response
        })
    }

    async fn routed(
        &self,
        peer: IpAddr,
        request: Request<Incoming>,
    ) -> Result<Response<Payload>, Refused> {
        let path = request.uri().path();
        if path != HEALTH {
            self.admit(request.headers())?;
        }
        let method = PATHS.iter().find(|(known, _)| *known == path);
        let Some((_, method)) = method else {
            let known = PATHS.map(|(path, _)| path).join(", ");
            let what = format!("there is nothing at {path}, there are {known}");
            return Err(Refused::new(Code::UnknownPath, what));
        };
        if request.method() != method {
            let what = format!("{path} takes {method}, not {}", request.method());
            return Err(Refused::new(Code::HttpMethod, what));
        }
        Ok(match path {
            "/v1/requests" => self.ask(peer, request).await?,
            "/v1/events" => {
                let last = request.headers().get("last-event-id");
                let last = last.map(|it| it.to_str().unwrap_or_default());
                let feed = Either::Right(self.events.listen(last));
                let mut response = typed(Response::new(feed), "text/event-stream");
                let never = HeaderValue::from_static("no-store");
                response.headers_mut().insert(CACHE_CONTROL, never);
                response
            }
            HEALTH => self.health(),
            _ => {
                let places = |it: &Places| it.taken() as i64;
                self.figures.connections.set(places(&self.connections));
                self.figures.waiting.set(places(&self.waiting));
                let listening = self.events.listening() as i64;
                self.figures.listeners.set(listening);
                let text = Either::Left(Full::from(self.figures.text()));
                typed(Response::new(text), figures::CONTENT_TYPE)
            }
        })
    }

    fn health(&self) -> Response<Payload> {
        let is_stopping = self.stopping.load(Ordering::SeqCst);
        let revision = Some(self.figures.revision.get()).filter(|it| *it > 0);
        let status = if is_stopping { "stopping" } else { "ok" };
        let object = json!({ "status": status, "protocol": PROTOCOL, "revision": revision });
        let code = is_stopping.then_some(Code::Stopping);
        said(code, Bytes::from(format!("{object}\n")))
    }

    /// Whether a request may be answered: it has the token. Where there is none, it is asked for
    /// under a name of this machine: a page in a browser that makes its own name mean this machine
    /// does not get that far.
    fn admit(&self, headers: &HeaderMap) -> Result<(), Refused> {
        let text = |name| headers.get(name).and_then(|it| it.to_str().ok());
        if let Some(token) = &self.token {
            let given = text(AUTHORIZATION).and_then(|it| it.split_once(' '));
            let given = given.filter(|(scheme, _)| scheme.eq_ignore_ascii_case("bearer"));
            let digest: Option<[u8; 32]> =
                given.map(|(_, given)| Sha256::digest(given.trim()).into());
            if digest.as_ref() != Some(token) {
                let what = "a request carries `Authorization: Bearer TOKEN`";
                return Err(Refused::new(Code::Unauthorized, what));
            }
            return Ok(());
        }
        let host = text(HOST).unwrap_or_default();
        let name = match host.rsplit_once(':') {
            Some((name, port)) if port.bytes().all(|it| it.is_ascii_digit()) => name,
            _ => host,
        };
        let name = name.trim_start_matches('[').trim_end_matches(']');
        let is_own = name.parse().is_ok_and(|it: IpAddr| it.is_loopback());
        if !is_own && !name.eq_ignore_ascii_case("localhost") {
            let what = format!("`{host}` is not localhost, 127.0.0.1 or [::1]");
            return Err(Refused::new(Code::ForeignHost, what));
        }
        Ok(())
    }

    /// Hands a request to the service.
    async fn ask(
        &self,
        peer: IpAddr,
        request: Request<Incoming>,
    ) -> Result<Response<Payload>, Refused> {
        let kind = request.headers().get(CONTENT_TYPE);
        let kind = kind.and_then(|it| it.to_str().ok()).unwrap_or_default();
        let kind = kind.split(';').next().unwrap_or_default().trim();
        // Pages in browsers cannot say so without asking first, and no answer allows them to.
        if !kind.eq_ignore_ascii_case("application/json") {
            let what = "a request is sent with `Content-Type: application/json`";
            return Err(Refused::new(Code::MediaType, what));
        }
        if self.stopping.load(Ordering::SeqCst) {
            return Err(Refused::new(Code::Stopping, STOPPING));
        }
        let Some(place) = self.waiting.take(peer) else {
            let what = "as many requests wait as may; ask again later";
            return Err(Refused::new(Code::Busy, what));
        };
        let came = Instant::now();
        let mut held = Held {
            of: Arc::clone(&self.held_bytes),
            bytes: 0,
        };
        let body = timeout(BODY, whole(request.into_body(), &mut held)).await;
        let body = body.map_err(|_| {
            let what = format!("the body did not come within {} s", BODY.as_secs());
            Refused::new(Code::Slow, what)
        })??;
        let line = text_of(body).map_err(|what| Refused::new(Code::Malformed, what))?;
        let (reply, answer) = oneshot::channel();
        let job = Job {
            line,
            came,
            reply,
            _room: (place, held),
        };
        let gone = |_| Refused::new(Code::Stopping, STOPPING);
        self.jobs.send(job).map_err(|_| gone(()))?;
        let (code, bytes) = answer.await.map_err(|_| gone(()))?;
        Ok(said(code, bytes))
    }
}

const HEALTH: &str = "/healthz";
/// What there is, and how it is asked for.
const PATHS: [(&str, Method); 4] = [
    ("/v1/requests", Method::POST),
    ("/v1/events", Method::GET),
    (HEALTH, Method::GET),
    ("/metrics", Method::GET),
];

/// Bytes of bodies that are held, until this is dropped.
struct Held {
    of: Arc<AtomicUsize>,
    bytes: usize,
}

impl Drop for Held {
    fn drop(&mut self) {
        self.of.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

/// A body, as far as it may go.
async fn whole(mut body: Incoming, held: &mut Held) -> Result<Vec<u8>, Refused> {
    let too_much = || {
        let what = format!("the body has more than {} MiB", MOST_BYTES >> 20);
        Refused::new(Code::TooMuch, what)
    };
    if body.size_hint().lower() > MOST_BYTES as u64 {
        return Err(too_much());
    }
    let mut bytes = Vec::new();
    while let Some(frame) = body.frame().await {
        let frame = frame.map_err(|it| cut_short(&it))?;
        let Ok(data) = frame.into_data() else {
            continue;
        };
        if bytes.len() + data.len() > MOST_BYTES {
            return Err(too_much());
        }
        held.bytes += data.len();
        if held.of.fetch_add(data.len(), Ordering::Relaxed) + data.len() > MOST_HELD_BYTES {
            let what = "the bodies that are held at once are too large; ask again later";
            return Err(Refused::new(Code::Busy, what));
        }
        bytes.extend_from_slice(&data);
    }
    Ok(bytes)
}

fn cut_short(error: &impl Display) -> Refused {
    Refused::new(Code::Malformed, format!("the body ends early: {error}"))
}

fn typed(mut response: Response<Payload>, kind: &'static str) -> Response<Payload> {
    let kind = HeaderValue::from_static(kind);
    response.headers_mut().insert(CONTENT_TYPE, kind);
    response
}

/// An object as an answer, with the status of its error.
fn said(code: Option<Code>, bytes: Bytes) -> Response<Payload> {
    let body = Either::Left(Full::from(bytes));
    let mut response = typed(Response::new(body), "application/json");
    *response.status_mut() = code.map_or(StatusCode::OK, status_of);
    let header = match code {
        Some(Code::Busy) => Some((RETRY_AFTER, "1")),
        Some(Code::Unauthorized) => Some((WWW_AUTHENTICATE, "Bearer")),
        _ => None,
    };
    if let Some((name, value)) = header {
        let value = HeaderValue::from_static(value);
        response.headers_mut().insert(name, value);
    }
    response
}

/// The status of an answer with an error.
fn status_of(code: Code) -> StatusCode {
    match code {
        Code::Malformed | Code::UnknownMethod | Code::Field => StatusCode::BAD_REQUEST,
        Code::TooMuch => StatusCode::PAYLOAD_TOO_LARGE,
        Code::NotOpen
        | Code::AlreadyOpen
        | Code::StaleRevision
        | Code::FutureRevision
        | Code::ClockBack
        | Code::NotVerified => StatusCode::CONFLICT,
        Code::Scenario
        | Code::Plan
        | Code::NoPlan
        | Code::Range
        | Code::Time
        | Code::UnknownDrone
        | Code::Jump
        | Code::Change => StatusCode::UNPROCESSABLE_ENTITY,
        Code::Deadline => StatusCode::GATEWAY_TIMEOUT,
        Code::UnknownPath => StatusCode::NOT_FOUND,
        Code::HttpMethod => StatusCode::METHOD_NOT_ALLOWED,
        Code::MediaType => StatusCode::UNSUPPORTED_MEDIA_TYPE,
        Code::Unauthorized => StatusCode::UNAUTHORIZED,
        Code::ForeignHost => StatusCode::MISDIRECTED_REQUEST,
        Code::Busy => StatusCode::TOO_MANY_REQUESTS,
        Code::Slow => StatusCode::REQUEST_TIMEOUT,
        Code::Stopping => StatusCode::SERVICE_UNAVAILABLE,
    }
}
