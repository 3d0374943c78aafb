"""An HTTP server that answers as a test says: what a login page, a proxy or a stranger may say."""

import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from email.message import Message
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

Answer = tuple[int, str, str]
"""Status, kind of content, content."""


@contextmanager
def answering(say: Callable[[str, str], Answer], hear: Callable[[Message], object] = len) -> Generator[str]:
    """A server's address; `say` answers a method and a path with its query, `hear` is told the headers of each."""

    class Handler(BaseHTTPRequestHandler):
        def answer(self) -> None:
            hear(self.headers)
            self.rfile.read(int(self.headers.get("Content-Length", 0)))
            status, kind, text = say(self.command, self.path)
            content = text.encode()
            self.send_response(status)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(content)))
            self.end_headers()
            self.wfile.write(content)

        do_GET = do_POST = do_DELETE = answer  # noqa: N815  the base class wants these names

        def log_message(self, format: str, *args: object) -> None:  # noqa: A002  inherited
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_address[1]}"
        finally:
            server.shutdown()
            thread.join()
