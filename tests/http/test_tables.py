"""Datasets whose tables take more memory than they may: views have the bytes that they have where all are kept, or, where
there is no room, say that they are not complete."""
import os

from harness import REAL, Daemon, run

TREE = os.environ["SPLATD_TREE"]
# Near a corner of the ground, for which some of the pages will do.
CORNER = "/v1/datasets/tree/view?width=96&height=64&eye=20,20,8&target=0,0,0&up=0,0,1&fov=50&format=png"


def view(*arguments):
    with Daemon(REAL, *arguments, datasets=[TREE]) as d:
        reply = d.ask(CORNER)
        assert reply.status == 200
        again = d.ask(CORNER + "&near=0.06")
        pick = d.ask("/v1/datasets/tree/pick?x=48&y=32&" + CORNER.split("?")[1].replace("&format=png", ""))
        return reply, again, pick.json(), d.status()["parameters"]["tables"]


def test_bytes_are_the_same_while_tables_come_by_page():
    whole, _, pick, limit = view()
    assert whole.headers["Splatd-Complete"] == "true" and limit == 256 << 20
    part, _, pick_again, limit = view("--tables", "120000")
    assert limit == 120000
    assert part.headers["Splatd-Complete"] == "true" and part.body == whole.body
    assert pick["position"] and pick == pick_again


def test_what_has_no_room_is_not_complete():
    least, again, _, _ = view("--tables", "0")
    assert least.headers["Splatd-Complete"] == again.headers["Splatd-Complete"] == "false"
    assert "ETag" not in least.headers


run(globals())
