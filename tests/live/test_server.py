"""What the viewer's server answers, and what it does not."""

from __future__ import annotations

import http.client
import json
import threading
import time

import pytest

from foldyn.live.server import KEY_HEADER, MOST_BYTES, MOST_CONNECTIONS, Server


@pytest.fixture
def server():
    asked = []

    def answer(wish):
        asked.append(wish)
        return {"got": wish}

    with Server(lambda key: f"<p>the page of {key}</p>", {"/compute": answer}) as made:
        made.asked = asked
        thread = threading.Thread(target=made.serve_forever, daemon=True)
        thread.start()
        yield made
        made.shutdown()
        thread.join()


def request(server, method, path, body=None, **headers):
    """Status, headers and text of an answer; headers with None are left out."""
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=10)
    given = {"Host": f"127.0.0.1:{server.server_port}"}
    if method == "POST":
        given |= {"Content-Type": "application/json", KEY_HEADER: server.key}
        body = json.dumps({"a": 1}) if body is None else body
        given["Content-Length"] = str(len(body))
    given |= {name.replace("_", "-"): value for name, value in headers.items()}
    connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
    for name, value in given.items():
        if value is not None:
            connection.putheader(name, value)
    connection.endheaders()
    if body is not None:
        connection.send(body.encode())
    response = connection.getresponse()
    text = response.read().decode()
    connection.close()
    return response.status, response.headers, text


@pytest.mark.matrix
def test_it_listens_to_this_machine_alone(server):
    assert server.server_address[0] == "127.0.0.1"
    assert server.address == f"http://127.0.0.1:{server.server_port}/{server.key}"


@pytest.mark.matrix
def test_the_page_and_its_answers(server):
    status, headers, text = request(server, "GET", f"/{server.key}")
    assert status == 200 and text == f"<p>the page of {server.key}</p>"
    assert headers["Cache-Control"] == "no-store" and headers["X-Content-Type-Options"] == "nosniff"
    assert headers["X-Frame-Options"] == "DENY" and headers["Referrer-Policy"] == "no-referrer"
    status, _, text = request(server, "POST", "/compute")
    assert status == 200 and json.loads(text) == {"got": {"a": 1}}
    status, _, _ = request(server, "POST", "/compute", Host=f"localhost:{server.server_port}")
    assert status == 200


def test_keys_differ_from_run_to_run():
    with Server(lambda key: key) as one, Server(lambda key: key) as other:
        assert one.key != other.key and len(one.key) >= 20


REFUSED = {
    "a host that another machine points here": ({"Host": "evil.example:80"}, 403),
    "another port": ({"Host": "127.0.0.1:1"}, 403),
    "no host": ({"Host": None}, 403),
    "another origin": ({"Origin": "https://evil.example"}, 403),
    "a sandboxed page": ({"Origin": "null"}, 403),
    "no key": ({KEY_HEADER: None}, 403),
    "another key": ({KEY_HEADER: "0" * 22}, 403),
    "a form": ({"Content-Type": "application/x-www-form-urlencoded"}, 415),
    "plain text, which other pages may send": ({"Content-Type": "text/plain"}, 415),
    "no type": ({"Content-Type": None}, 415),
    "a large body": ({"Content-Length": str(MOST_BYTES + 1)}, 413),
    "a huge number": ({"Content-Length": "9" * 5000}, 413),
    "a negative length": ({"Content-Length": "-1"}, 411),
    "no length": ({"Content-Length": None}, 411),
}


@pytest.mark.matrix
@pytest.mark.parametrize("name", REFUSED)
def test_foreign_requests_are_refused(server, name):
    headers, status = REFUSED[name]
    got, answered, _ = request(server, "POST", "/compute", **headers)
    assert got == status and answered["Connection"] == "close"
    assert server.asked == []


@pytest.mark.matrix
def test_what_is_no_json_is_refused(server):
    for body in ("{", "", "[" * 50_000):
        assert request(server, "POST", "/compute", body)[0] == 400
    assert server.asked == []


@pytest.mark.matrix
@pytest.mark.parametrize(
    "path", ["/", "/compute", "/etc/passwd", "/../../etc/passwd", "/%2e%2e/etc/passwd", "//x", "*"]
)
def test_no_other_path_is_known(server, path):
    status, _, text = request(server, "GET", path)
    assert status == 404 and "root:" not in text
    if path != "/compute":
        assert request(server, "POST", path)[0] == 404


@pytest.mark.matrix
def test_a_page_of_another_host_is_not_given(server):
    assert request(server, "GET", f"/{server.key}", Host="evil.example")[0] == 403


@pytest.mark.matrix
@pytest.mark.parametrize("method", ["PUT", "DELETE", "OPTIONS", "TRACE"])
def test_no_other_method_is_known(server, method):
    assert request(server, method, "/compute")[0] == 501


@pytest.mark.matrix
def test_connections_are_bounded_and_the_next_is_told_so(server):
    """Idle ones hold a thread each; as soon as one is gone there is room again."""
    before = threading.active_count()
    idle = [
        http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=10)
        for _ in range(MOST_CONNECTIONS)
    ]
    for connection in idle:
        connection.connect()
    for _ in range(3 * MOST_CONNECTIONS):
        status, headers, text = request(server, "GET", f"/{server.key}")
        assert (status, headers["Connection"]) == (503, "close")
        assert text.startswith("too many connections at once")
    assert threading.active_count() <= before + MOST_CONNECTIONS
    for connection in idle:
        connection.close()
    deadline = time.monotonic() + 10.0
    while request(server, "GET", f"/{server.key}")[0] != 200:
        assert time.monotonic() < deadline
    assert request(server, "POST", "/compute")[0] == 200
