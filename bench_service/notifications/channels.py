"""Delivery of one message to one target, by SMTP or by a webhook. Raises `Undelivered` with the reason."""

import hashlib
import hmac
import json
import smtplib
import ssl
from email.message import EmailMessage
from email.utils import format_datetime, make_msgid

from bench_service.notifications.messages import Message
from bench_service.notifications.targets import Mail, Webhook, secret

TIMEOUT_S = 10.0
SIGNATURE = "X-Bench-Signature"


class Undelivered(Exception):
    """Raised where a target did not take a message. `final`: it refused the message itself, and will again."""

    def __init__(self, text: str, final: bool = False) -> None:
        super().__init__(text)
        self.final = final


def deliver(target: Mail | Webhook, message: Message, pages: str) -> None:
    """Send a message to its target by SMTP or HTTP, and wait for the target's answer. Raises `Undelivered`,
    `Misconfigured`.
    """
    if isinstance(target, Mail):
        _mail(target, message, pages)
    else:
        _post(target, message, pages)


def _mail(target: Mail, message: Message, pages: str) -> None:
    mail = EmailMessage()
    mail["Subject"] = " ".join(message.title.split())[:200]
    mail["From"], mail["To"] = target.sender, ", ".join(target.to)
    mail["Date"], mail["Message-ID"] = format_datetime(message.at), make_msgid(domain=target.sender.partition("@")[2])
    mail["Auto-Submitted"] = "auto-generated"
    mail.set_content(f"{message.text}\n\n{pages}{message.page}\n", cte="quoted-printable")
    password = secret(target.password_file)
    try:
        made = smtplib.SMTP_SSL if target.security == "tls" else smtplib.SMTP
        with made(target.host, target.port, timeout=TIMEOUT_S) as server:
            if target.security == "starttls":
                server.starttls(context=ssl.create_default_context())
            if target.user is not None and password is not None:
                server.login(target.user, password)
            server.send_message(mail)
    except smtplib.SMTPRecipientsRefused as error:
        raise Undelivered(
            f"{target.host} refuses the recipients: {error.recipients}", final=_permanent(error)
        ) from error
    except (smtplib.SMTPException, OSError) as error:
        raise Undelivered(f"{target.host}:{target.port}: {error}") from error


def _permanent(error: smtplib.SMTPRecipientsRefused) -> bool:
    return all(code >= 500 for code, _ in error.recipients.values())


def _post(target: Webhook, message: Message, pages: str) -> None:
    import httpx  # a server that starts needs no client

    document = {
        "key": message.key,
        "kind": message.kind,
        "title": message.title,
        "text": message.text,
        "bench": message.bench,
        "at": message.at.isoformat(),
        "page": f"{pages}{message.page}",
    }
    body = json.dumps(document).encode()
    headers = {"Content-Type": "application/json"}
    if (key := secret(target.secret_file)) is not None:
        headers[SIGNATURE] = "sha256=" + hmac.new(key.encode(), body, hashlib.sha256).hexdigest()
    try:
        answer = httpx.post(target.url, content=body, headers=headers, timeout=TIMEOUT_S, trust_env=False)
    except httpx.HTTPError as error:
        raise Undelivered(f"the webhook {target.name}: {type(error).__name__}: {error}") from error
    if not answer.is_success:
        final = 400 <= answer.status_code < 500 and answer.status_code not in (408, 425, 429)
        raise Undelivered(f"the webhook {target.name} answered {answer.status_code}", final=final)
