//! HTTP on one's own machine: who may ask, for what, and how much.

use std::io::Read;
use std::sync::Arc;

use anyhow::anyhow;
use serde::de::DeserializeOwned;
use serde_json::json;
use tiny_http::{Header, Method, Request, Response};

use super::answer::{Answer, Refusal};
use super::session::Session;

/// Bytes of the longest request: a scene of a thousand materials with 24 coefficients each.
const LONGEST_REQUEST: usize = 1 << 20;

/// What a browser may do with the page: run what stands in it and ask this server.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; connect-src 'self'; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// A port of this machine.
pub(super) struct Server(tiny_http::Server);

/// Who may ask: whoever knows the token, from a page of this server.
pub(super) struct Guard {
    token: String,
    hosts: [String; 2],
}

impl Server {
    /// Listens at `port`, or at one that is free where that is 0.
    ///
    /// # Errors
    /// When the port is taken.
    pub(super) fn at(port: u16) -> anyhow::Result<Self> {
        let server = tiny_http::Server::http(("127.0.0.1", port));
        Ok(Self(server.map_err(|error| anyhow!("cannot listen at 127.0.0.1:{port}: {error}"))?))
    }

    /// Its port.
    pub(super) fn port(&self) -> u16 {
        self.0.server_addr().to_ip().map_or(0, |address| address.port())
    }

    /// Answers requests, one after the other.
    pub(super) fn run(&self, guard: &Guard, session: &Arc<Session>) {
        while let Ok(mut request) = self.0.recv() {
            let answer = answer(&mut request, guard, session);
            // A browser that has gone away needs no answer.
            let _ = request.respond(response(answer));
        }
    }
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

    /// What requests must know.
    pub(super) fn token(&self) -> &str {
        &self.token
    }

    /// Where the page is.
    pub(super) fn address(&self) -> String {
        format!("http://{}/?token={}", self.hosts[0], self.token)
    }

    /// Checks who asks. Names that lead here from elsewhere, and pages of other servers, may not.
    fn admit(&self, request: &Request) -> Result<(), Refusal> {
        let host = header(request, "Host").unwrap_or_default();
        let is_ours = |host: &str| self.hosts.iter().any(|own| own == host);
        if !is_ours(host) {
            return Err(Refusal::forbidden("this server answers at 127.0.0.1 and localhost"));
        }
        let origin = header(request, "Origin").map(|origin| origin.strip_prefix("http://").unwrap_or(""));
        if origin.is_some_and(|origin| !is_ours(origin)) {
            return Err(Refusal::forbidden("pages of other servers are not answered"));
        }
        let known = match *request.method() {
            Method::Get => request.url().split_once("token=").map(|(_, token)| token),
            _ => header(request, "X-Sonel-Token"),
        };
        if known != Some(self.token.as_str()) {
            return Err(Refusal::forbidden("the token is missing: open the address that sonel-view printed"));
        }
        Ok(())
    }
}

fn header<'a>(request: &'a Request, name: &'static str) -> Option<&'a str> {
    let found = request.headers().iter().find(|header| header.field.equiv(name))?;
    Some(found.value.as_str())
}

/// The answer to a request.
fn answer(request: &mut Request, guard: &Guard, session: &Arc<Session>) -> Result<Answer, Refusal> {
    guard.admit(request)?;
    let path = request.url().split('?').next().unwrap_or_default().to_owned();
    match (request.method(), &path[..]) {
        (Method::Get, "/") => Ok(Answer::Page(session.page())),
        (Method::Post, "/api/state") => session.state(),
        (Method::Post, "/api/render") => session.render(&read(request)?),
        (Method::Post, "/api/grid") => session.grid(&read(request)?),
        (Method::Post, "/api/sound") => session.sound(&read(request)?),
        (Method::Post, "/api/trace") => session.trace_changed(&read(request)?),
        (Method::Post, "/api/materials") => session.materials(&read(request)?),
        (Method::Post, "/api/save") => session.save(&read(request)?),
        _ => Err(Refusal { status: 404, text: format!("there is no {path}") }),
    }
}

/// What a request says.
fn read<T: DeserializeOwned>(request: &mut Request) -> Result<T, Refusal> {
    let mut body = Vec::new();
    let most = LONGEST_REQUEST as u64 + 1;
    let read = request.as_reader().take(most).read_to_end(&mut body);
    read.map_err(|error| Refusal::wrong(format!("the request cannot be read: {error}")))?;
    if body.len() > LONGEST_REQUEST {
        return Err(Refusal { status: 413, text: format!("a request has at most {LONGEST_REQUEST} bytes") });
    }
    serde_json::from_slice(&body)
        .map_err(|error| Refusal::wrong(format!("the request is not understood: {error}")))
}

fn response(answer: Result<Answer, Refusal>) -> Response<std::io::Cursor<Vec<u8>>> {
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
    headers.into_iter().fold(Response::from_data(body).with_status_code(status), |response, (name, value)| {
        response.with_header(Header::from_bytes(name, value).expect("constant texts of ASCII"))
    })
}
