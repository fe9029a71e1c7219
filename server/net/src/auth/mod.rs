//! Authentication: bearer tokens and their roles.
//!
//! A token is `plm_<id>_<secret>`: the id finds the row, the SHA-256 of the secret is compared in constant time. Only the hash is stored,
//! so that a copy of the database gives no access.

use anyhow::{Context, bail};
use axum::http::HeaderMap;
use axum::http::header::{AUTHORIZATION, SEC_WEBSOCKET_PROTOCOL};
use palmares_protocol::{Code, Refusal};
use palmares_store::{NewAuditEntry, NewToken, Store, StoreError};
use sha2::{Digest, Sha256};
use std::collections::BTreeSet;
use std::fmt;
use subtle::{Choice, ConstantTimeEq};
use tokio::sync::watch;

const PREFIX: &str = "plm";
/// Hexadecimal digits of a token's id.
const ID_DIGITS: usize = 16;
/// Hexadecimal digits of its secret: 256 random bits.
const SECRET_DIGITS: usize = 64;
/// Prefix of a token that is offered as a subprotocol.
const TOKEN_PROTOCOL: &str = "palmares.token.";
/// Compared when no hash is stored; of equal length.
const DUMMY_HASH: &str = "0000000000000000000000000000000000000000000000000000000000000000";

/// The role of a token.
#[derive(Clone, Copy, Debug, PartialEq, Eq, strum::EnumString, strum::IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum Role {
    /// May play, and read the team's own data.
    Team,
    /// May run the competition.
    Organizer,
    /// May watch.
    Viewer,
}

impl Role {
    /// The role as stored.
    pub fn word(self) -> &'static str {
        self.into()
    }
}

/// The holder of a valid token.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Id of the token.
    pub token_id: String,
    /// Its role.
    pub role: Role,
    /// Its team, for the role `team`.
    pub team: Option<String>,
}

/// A token with its secret; shown once.
pub struct Token {
    /// Its id.
    pub id: String,
    secret: String,
}

impl Token {
    /// A random token.
    pub fn random() -> Result<Self, getrandom::Error> {
        Ok(Token { id: random_hex(ID_DIGITS / 2)?, secret: random_hex(SECRET_DIGITS / 2)? })
    }

    /// The whole token, for its holder.
    pub fn reveal(&self) -> String {
        format!("{PREFIX}_{}_{}", self.id, self.secret)
    }

    /// The hash of the secret, as stored.
    pub fn secret_hash(&self) -> String {
        sha256_hex(self.secret.as_bytes())
    }

    /// Compares the stored hash in constant time. Without one a dummy of equal length is compared, so that the answer takes as long for
    /// an unknown id.
    fn has_hash(&self, stored: Option<&str>) -> bool {
        let same = self.secret_hash().as_bytes().ct_eq(stored.unwrap_or(DUMMY_HASH).as_bytes());
        (same & Choice::from(u8::from(stored.is_some()))).into()
    }

    /// Reads a token as clients send it; none if it has another form.
    pub fn parse(text: &str) -> Option<Token> {
        let (id, secret) = text.strip_prefix(PREFIX)?.strip_prefix('_')?.split_once('_')?;
        let hex = |part: &str, digits| part.len() == digits && part.bytes().all(|b| b.is_ascii_hexdigit());
        (hex(id, ID_DIGITS) && hex(secret, SECRET_DIGITS))
            .then(|| Token { id: id.to_owned(), secret: secret.to_owned() })
    }
}

impl fmt::Debug for Token {
    /// Shows the id only.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Token({})", self.id)
    }
}

/// `bytes` random bytes as lower-case hexadecimal.
pub fn random_hex(bytes: usize) -> Result<String, getrandom::Error> {
    let mut buffer = vec![0; bytes];
    getrandom::fill(&mut buffer)?;
    Ok(hex::encode(&buffer))
}

/// SHA-256 as lower-case hexadecimal.
pub fn sha256_hex(bytes: &[u8]) -> String {
    hex::encode(Sha256::digest(bytes))
}

/// Checks tokens, and closes open connections when one is revoked.
#[derive(Debug, Default)]
pub struct Auth {
    /// Ids of the tokens revoked since the server started.
    revoked: watch::Sender<BTreeSet<String>>,
}

fn refused() -> Refusal {
    let message = "the token is missing or not valid; send it as the header `Authorization: Bearer <token>`";
    Refusal::new(Code::NotAuthorized, message)
}

/// The token in the header `Authorization`; None without the header.
fn bearer(headers: &HeaderMap) -> Result<Option<Token>, Refusal> {
    let mut values = headers.get_all(AUTHORIZATION).iter();
    let Some(value) = values.next() else { return Ok(None) };
    if values.next().is_some() {
        return Err(refused());
    }
    let text = value.to_str().map_err(|_| refused())?;
    let (scheme, token) = text.split_once(' ').ok_or_else(refused)?;
    if !scheme.eq_ignore_ascii_case("bearer") {
        return Err(refused());
    }
    Token::parse(token.trim()).ok_or_else(refused).map(Some)
}

/// The token that is offered as a subprotocol; None without one.
fn offered(headers: &HeaderMap) -> Result<Option<Token>, Refusal> {
    let mut token = None;
    for value in headers.get_all(SEC_WEBSOCKET_PROTOCOL) {
        let text = value.to_str().map_err(|_| refused())?;
        for offer in text.split(',').filter_map(|offer| offer.trim().strip_prefix(TOKEN_PROTOCOL)) {
            if token.replace(Token::parse(offer).ok_or_else(refused)?).is_some() {
                return Err(refused());
            }
        }
    }
    Ok(token)
}

impl Auth {
    /// The identity behind these headers; None without a token.
    ///
    /// # Errors
    /// The token is not valid or revoked: always with the same message.
    pub async fn identify(&self, store: &Store, headers: &HeaderMap) -> Result<Option<Identity>, Refusal> {
        match bearer(headers)? {
            Some(token) => Self::holder(store, token).await.map(Some),
            None => Ok(None),
        }
    }

    /// The identity behind the headers of a WebSocket, also from a browser: it cannot set `Authorization` there and offers the token as a
    /// subprotocol.
    pub async fn identify_browser(
        &self,
        store: &Store,
        headers: &HeaderMap,
    ) -> Result<Option<Identity>, Refusal> {
        match (bearer(headers)?, offered(headers)?) {
            (Some(token), None) | (None, Some(token)) => Self::holder(store, token).await.map(Some),
            (None, None) => Ok(None),
            (Some(_), Some(_)) => Err(refused()),
        }
    }

    async fn holder(store: &Store, token: Token) -> Result<Identity, Refusal> {
        let row = store.token(&token.id).await?;
        let same = token.has_hash(row.as_ref().map(|row| row.secret_hash.as_str()));
        let row = row.filter(|row| same && row.revoked_unix_ms.is_none()).ok_or_else(refused)?;
        let role = row.role.parse().map_err(|_| refused())?;
        Ok(Identity { token_id: row.token_id, role, team: row.team })
    }

    /// The identity behind these headers; refused without a token.
    pub async fn require(&self, store: &Store, headers: &HeaderMap) -> Result<Identity, Refusal> {
        self.identify(store, headers).await?.ok_or_else(refused)
    }

    /// The identity of an organizer; refused for others.
    pub async fn organizer(&self, store: &Store, headers: &HeaderMap) -> Result<Identity, Refusal> {
        let identity = self.require(store, headers).await?;
        if identity.role == Role::Organizer { Ok(identity) } else { Err(forbidden("an organizer's token")) }
    }

    /// Closes the connections of these tokens.
    pub fn revoke(&self, token_ids: impl IntoIterator<Item = String>) {
        self.revoked.send_if_modified(|revoked| {
            let before = revoked.len();
            revoked.extend(token_ids);
            revoked.len() > before
        });
    }

    /// Returns when the token is revoked, at once if that has happened since the server started; never without a token.
    pub async fn revoked(&self, identity: Option<&Identity>) {
        match identity {
            // The sender is in `self`: waiting cannot fail.
            Some(identity) => {
                let _ =
                    self.revoked.subscribe().wait_for(|revoked| revoked.contains(&identity.token_id)).await;
            }
            None => std::future::pending().await,
        }
    }
}

/// The refusal for a valid token with the wrong role.
pub fn forbidden(needed: &str) -> Refusal {
    Refusal::new(Code::Forbidden, format!("this needs {needed}"))
}

/// Creates and stores a token. With `only`, the other tokens of its team are revoked; their ids are returned.
///
/// # Errors
/// No randomness, or the database failed.
pub async fn issue(
    store: &Store,
    role: Role,
    team: Option<&str>,
    label: &str,
    only: bool,
    entry: &NewAuditEntry<'_>,
) -> anyhow::Result<(Token, Vec<String>)> {
    let token = Token::random().context("no randomness for a token")?;
    let revoked = add(store, &token, role, team, label, only, entry).await?;
    Ok((token, revoked))
}

/// Stores a new token. Returns the ids of the tokens that it replaces.
///
/// # Errors
/// The database failed.
pub async fn add(
    store: &Store,
    token: &Token,
    role: Role,
    team: Option<&str>,
    label: &str,
    only: bool,
    entry: &NewAuditEntry<'_>,
) -> Result<Vec<String>, StoreError> {
    let secret_hash = token.secret_hash();
    let row = NewToken { token_id: &token.id, role: role.word(), team, label, secret_hash: &secret_hash };
    store.add_token(&row, only, entry).await
}

/// Stores an organizer's token that was made elsewhere, unless it is stored already. Several servers may do so at once.
///
/// # Errors
/// The token's id is that of another token, or the database failed.
pub async fn admit_organizer(store: &Store, token: &Token, label: &str) -> anyhow::Result<()> {
    let secret_hash = token.secret_hash();
    let row = NewToken {
        token_id: &token.id,
        role: Role::Organizer.word(),
        team: None,
        label,
        secret_hash: &secret_hash,
    };
    let entry =
        NewAuditEntry { actor: "server", action: "token.issue", subject: "organizer", reason: Some(label) };
    let mut stored = store.token(&token.id).await?;
    if stored.is_none() {
        let added = store.add_token(&row, false, &entry).await;
        // Another server may have been quicker.
        stored = store.token(&token.id).await?;
        if stored.is_none() {
            added?;
        }
    }
    match stored {
        Some(row) if row.role != Role::Organizer.word() || !token.has_hash(Some(&row.secret_hash)) => {
            bail!("its id {} is that of another token", token.id)
        }
        Some(row) if row.revoked_unix_ms.is_some() => {
            tracing::warn!(id = token.id, "the organizer's token of the file is revoked");
            Ok(())
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_is_read_back_and_its_secret_is_not_shown() {
        let token = Token::random().expect("randomness");
        let text = token.reveal();
        let back = Token::parse(&text).expect("a token");
        assert_eq!((&back.id, back.secret_hash()), (&token.id, token.secret_hash()));
        assert!(!format!("{token:?}").contains(&token.secret));
        assert_ne!(Token::random().expect("randomness").secret, token.secret);
    }

    #[test]
    fn a_secret_is_compared_with_as_many_bytes_when_nothing_is_stored() {
        let token = Token::random().expect("randomness");
        let other = Token::random().expect("randomness");
        assert_eq!(DUMMY_HASH.len(), token.secret_hash().len());
        assert!(token.has_hash(Some(&token.secret_hash())));
        assert!(!token.has_hash(Some(&other.secret_hash())) && !token.has_hash(Some(DUMMY_HASH)));
        assert!(!token.has_hash(None) && !token.has_hash(Some("")));
    }

    #[test]
    fn a_browser_offers_its_token_as_a_subprotocol_and_only_one() {
        let token = Token::random().expect("randomness");
        let text = token.reveal();
        let headers = |values: &[String]| {
            let mut headers = HeaderMap::new();
            for value in values {
                headers.append(SEC_WEBSOCKET_PROTOCOL, value.parse().expect("a value"));
            }
            headers
        };
        let token_offered = offered(&headers(&[format!("palmares.v1.bin, palmares.token.{text}")]));
        assert_eq!(token_offered.expect("valid").map(|token| token.id), Some(token.id));
        assert!(matches!(offered(&headers(&["palmares.v1.bin".into()])), Ok(None)));
        let twice = format!("palmares.token.{text},palmares.token.{text}");
        let separate = [format!("palmares.token.{text}"), format!("palmares.token.{text}")];
        for wrong in
            [&[twice][..], &separate, &["palmares.token.".into()], &["palmares.token.plm_1_2".into()]]
        {
            assert!(offered(&headers(wrong)).is_err());
        }
    }

    #[test]
    fn malformed_tokens_are_refused() {
        let good = Token::random().expect("randomness").reveal();
        let short = &good[..good.len() - 1];
        for bad in
            ["", "plm", "plm__", "../..", &good[1..], short, &format!("{good}0"), &good.replace('_', "-")]
        {
            assert!(Token::parse(bad).is_none(), "{bad}");
        }
    }
}
