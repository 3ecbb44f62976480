//! HTTP on one's own machine: who may ask, for what, how much, and how slowly.

use std::convert::Infallible;
use std::net::TcpListener;
use std::sync::Arc;
use std::time::Duration;

use anyhow::anyhow;
use http_body_util::{BodyExt, Full, Limited};
use hyper::body::{Bytes, Incoming};
use hyper::http::request::Parts;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper::{Method, Request, Response};
use hyper_util::rt::{TokioIo, TokioTimer};
use serde::de::DeserializeOwned;
use serde_json::json;
use tokio::{runtime, task, time};

use super::answer::{Answer, Refusal};
use super::session::Session;

/// Requests that are worked on at the same time: several windows, each with a rendering, a map and a sound.
const AT_ONCE: usize = 8;
/// Bytes of the longest request: a scene of a thousand materials with 24 coefficients each.
const LONGEST_REQUEST: usize = 1 << 20;
/// How long the head of a request may take to arrive, and how long its body.
const LONGEST_WAIT: Duration = Duration::from_secs(10);
/// Until a connection is tried again where the system has no more.
const NEXT_TRY: Duration = Duration::from_millis(50);

/// What a browser may do with the page: run what stands in it and ask this server.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; connect-src 'self'; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Who may ask: whoever knows the token, from a page of this server.
pub(super) struct Guard {
    /// What requests must know.
    pub token: String,
    hosts: [String; 2],
}

/// Answers requests at `listener` for ever. One thread waits for all connections, so that those that send nothing cost nobody anything.
///
/// # Errors
/// When the system has no events.
pub(super) fn run(listener: TcpListener, guard: Guard, session: Arc<Session>) -> anyhow::Result<()> {
    let runtime =
        runtime::Builder::new_current_thread().enable_all().max_blocking_threads(AT_ONCE).build()?;
    runtime.block_on(async {
        listener.set_nonblocking(true)?;
        let (listener, guard) = (tokio::net::TcpListener::from_std(listener)?, Arc::new(guard));
        loop {
            let Ok((stream, _)) = listener.accept().await else {
                time::sleep(NEXT_TRY).await;
                continue;
            };
            let (guard, session) = (Arc::clone(&guard), Arc::clone(&session));
            let service =
                service_fn(move |request| answer(request, Arc::clone(&guard), Arc::clone(&session)));
            let mut connection = http1::Builder::new();
            connection.timer(TokioTimer::new()).header_read_timeout(LONGEST_WAIT);
            // A browser that has gone away needs no answer.
            task::spawn(connection.serve_connection(TokioIo::new(stream), service));
        }
    })
}

impl Guard {
    /// A guard with a new token for the server at `port`.
    ///
    /// # Errors
    /// When the system has no random numbers.
    pub(super) fn new(port: u16) -> anyhow::Result<Self> {
        let mut random = [0; 16];
        getrandom::fill(&mut random).map_err(|error| anyhow!("no random numbers: {error}"))?;
        let token = random.iter().map(|byte| format!("{byte:02x}")).collect();
        Ok(Self { token, hosts: [format!("127.0.0.1:{port}"), format!("localhost:{port}")] })
    }

    /// Where the page is.
    pub(super) fn address(&self) -> String {
        format!("http://{}/?token={}", self.hosts[0], self.token)
    }

    /// Checks who asks. Names that lead here from elsewhere, and pages of other servers, may not.
    fn admit(&self, request: &Parts) -> Result<(), Refusal> {
        let host = header(request, "Host").unwrap_or_default();
        let is_ours = |host: &str| self.hosts.iter().any(|own| own == host);
        if !is_ours(host) {
            return Err(Refusal::forbidden("this server answers at 127.0.0.1 and localhost"));
        }
        let origin = header(request, "Origin").map(|origin| origin.strip_prefix("http://").unwrap_or(""));
        if origin.is_some_and(|origin| !is_ours(origin)) {
            return Err(Refusal::forbidden("pages of other servers are not answered"));
        }
        let known = match request.method {
            Method::GET => request.uri.query().and_then(|query| query.strip_prefix("token=")),
            _ => header(request, "X-Sonel-Token"),
        };
        if known != Some(self.token.as_str()) {
            return Err(Refusal::forbidden("the token is missing: open the address that sonel-view printed"));
        }
        Ok(())
    }
}

fn header<'a>(request: &'a Parts, name: &str) -> Option<&'a str> {
    request.headers.get(name)?.to_str().ok()
}

/// The answer to a request. Who may not ask is refused before anything is read.
async fn answer(
    request: Request<Incoming>,
    guard: Arc<Guard>,
    session: Arc<Session>,
) -> Result<Response<Full<Bytes>>, Infallible> {
    let (head, body) = request.into_parts();
    let read_and_work = async {
        guard.admit(&head)?;
        let body = time::timeout(LONGEST_WAIT, Limited::new(body, LONGEST_REQUEST).collect()).await;
        let body =
            body.map_err(|_| Refusal { status: 408, text: "the request takes too long".to_owned() })?;
        let text = format!("a request is whole and has at most {LONGEST_REQUEST} bytes");
        let body = body.map_err(|_| Refusal { status: 413, text })?.to_bytes();
        let work = task::spawn_blocking(move || answer_of(&head, &body, &session));
        work.await.unwrap_or_else(|fault| Err(Refusal::failed(&fault)))
    };
    Ok(response(read_and_work.await))
}

/// What the session answers to a request that was admitted and read.
fn answer_of(head: &Parts, body: &[u8], session: &Arc<Session>) -> Result<Answer, Refusal> {
    match (&head.method, head.uri.path()) {
        (&Method::GET, "/") => Ok(Answer::Page(session.page())),
        (&Method::POST, "/api/state") => session.state(),
        (&Method::POST, "/api/render") => session.render(&read(body)?),
        (&Method::POST, "/api/grid") => session.grid(&read(body)?),
        (&Method::POST, "/api/sound") => session.sound(&read(body)?),
        (&Method::POST, "/api/trace") => session.trace_changed(&read(body)?),
        (&Method::POST, "/api/materials") => session.materials(&read(body)?),
        (&Method::POST, "/api/save") => session.save(&read(body)?),
        (_, path) => Err(Refusal { status: 404, text: format!("there is no {path}") }),
    }
}

/// What a request says.
fn read<T: DeserializeOwned>(body: &[u8]) -> Result<T, Refusal> {
    serde_json::from_slice(body)
        .map_err(|error| Refusal::wrong(format!("the request is not understood: {error}")))
}

fn response(answer: Result<Answer, Refusal>) -> Response<Full<Bytes>> {
    let (status, kind, body) = match answer {
        Ok(Answer::Page(text)) => (200, "text/html; charset=utf-8", text.into_bytes()),
        Ok(Answer::Json(value)) => (200, "application/json", value.to_string().into_bytes()),
        Ok(Answer::Samples(samples)) => {
            (200, "application/octet-stream", samples.into_iter().flat_map(f32::to_le_bytes).collect())
        }
        Err(Refusal { status, text }) => {
            (status, "application/json", json!({ "error": text }).to_string().into_bytes())
        }
    };
    let headers = [
        ("Content-Type", kind),
        ("Content-Security-Policy", POLICY),
        ("Cache-Control", "no-store"),
        ("Referrer-Policy", "no-referrer"),
        ("X-Content-Type-Options", "nosniff"),
    ];
    let head = Response::builder().status(status);
    let head = headers.into_iter().fold(head, |head, (name, value)| head.header(name, value));
    head.body(Full::from(body)).expect("constant texts of ASCII")
}
