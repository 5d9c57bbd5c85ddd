"""What is soft over HTTP: it comes back in a header, from every route that takes it, counts in ETags only where there is
something soft, and is refused where the dataset has nothing of it."""
import json
import math
import re
import struct
import threading

from harness import FAKE, PATIENT, REAL, VIEW, Daemon, Hold, eventually, run, together

PICK = VIEW.replace("/view", "/pick")
AXIS = "axis:0,0,0,0,0,1<0.5"


def soft(reply):
    return json.loads(reply.headers["Splatd-Soft"])


def test_what_is_soft_comes_back():
    with Daemon(REAL) as d:
        query = f"width=16&height=16&soft=0.25%3Cclass&soft={AXIS}&soft_opacity=0.5&soft_model=concentric"
        whole = {"soft": ["class>0.25", AXIS], "soft_model": "concentric", "soft_opacity": 0.5,
                 "soft_cover": 1, "soft_blend": 0, "of": "solid"}
        first = d.ask(f"{VIEW}?{query}")
        assert first.status == 200 and soft(first) == whole, first.headers
        assert soft(d.ask(f"{VIEW}?{query}", "HEAD")) == whole
        again = d.post({"width": 16, "height": 16, **soft(first)})
        assert again.headers["Splatd-Cache"] == "hit" and soft(again) == whole
        pick = d.ask(f"{PICK}?x=8&y=8&{query}")
        assert pick.status == 200 and soft(pick) == whole
        asked = {"soft": [AXIS], "soft_model": "base", "soft_opacity": 0.75, "soft_cover": 0.25, "soft_blend": 0.5, "of": "median"}
        assert soft(d.ask(f"{PICK}?x=8&y=8&soft={AXIS}&soft_model=base&soft_opacity=0.75&soft_cover=0.25&soft_blend=0.5&of=median")) == asked
        assert soft(d.post({"x": 8, "y": 8, **asked}, PICK)) == asked
        for text in ["class>3", "class:*", "plane:0,0,1,0,0,1>=0", "box:-1,-1,-1,1,1,1", AXIS + " or " + AXIS]:
            reply = d.post({"width": 8, "height": 8, "soft": text, "soft_blend": 0.1, "soft_model": "layer"})
            assert reply.status == 200 and " or ".join(soft(reply)["soft"]) == text, reply.headers
        assert d.ask(f"{VIEW}?width=16&height=16&soft_opacity=0.5").headers["Splatd-Soft"] is None
        batch = d.ask(VIEW + "s", "POST", json.dumps({"width": 8, "height": 8, "soft": AXIS, "views": [{}, {"soft": []}]}))
        assert batch.status == 200 and batch.body.count(b"Splatd-Soft: ") == 1, batch.body[:2000]


def test_layers_and_picks_speak_of_what_is_asked_for():
    """The wall is x = 0.2 sin y; what is nearer than x = 0.1 becomes soft, and behind it lies nothing."""
    near = {"eye": "3,0.8,1", "target": "0,0.8,1", "fov": 40, "width": 64, "height": 48, "soft": "plane:0.1,0,0,1,0,0>0", "soft_opacity": 0.8}
    with Daemon(REAL) as d:
        def pick(**more):
            query = "&".join(f"{k}={v}" for k, v in {**near, "x": 32, "y": 24, **more}.items())
            reply = d.ask(f"{PICK}?{query}")
            assert reply.status == 200 and soft(reply)["of"] == more.get("of", "solid"), reply.body
            return reply.json()
        assert pick()["position"] is None and pick(of="solid")["position"] is None
        first, median = pick(of="first"), pick(of="median")
        assert first["primitive"] == "splat" and abs(first["normal"][0]) > 0.9 and first["class"] == 0, first
        assert 0.1 < first["position"][0] < 0.2 and first["splat"] is not None and first["attributes"], first
        assert median["position"] and first["depth"] <= median["depth"], (first, median)
        assert pick(of="first", soft_opacity=0.05)["position"] and pick(of="median", soft_opacity=0.01)["position"] is None
        for model in "base", "concentric", "layer":
            assert pick(of="first", soft_model=model)["splat"] == first["splat"]
            assert pick(of="median", soft_model=model)["position"], model
        assert pick(of="first", soft_opacity=0)["position"] is None and pick(of="median", soft_opacity=0)["position"] is None
        body = {"x": 32, "y": 24, "camera": {"eye": [3, 0.8, 1], "target": [0, 0.8, 1], "fov": 40}, "width": 64, "height": 48,
                "soft": near["soft"], "soft_opacity": 0.8, "of": "first"}
        assert d.post(body, PICK).json()["splat"] == first["splat"]
        def depths(**more):
            reply = d.view(**near, layer="depth", format="raw", **more)
            return struct.unpack(f"<{64 * 48}f", reply.body)
        solid, nearest, half = depths(), depths(of="first"), depths(of="median")
        assert math.isnan(solid[24 * 64 + 32]) and abs(nearest[24 * 64 + 32] - first["depth"]) < 0.02
        for a, b, c in zip(nearest, half, solid):
            assert not a > b and not b > c and not (math.isnan(a) and not math.isnan(c)), (a, b, c)
        assert sum(not math.isnan(z) for z in nearest) > sum(not math.isnan(z) for z in half) > sum(not math.isnan(z) for z in solid)
        assert d.view(**near).body == d.view(**near, of="first").body, "colours stay what they are"


SLOW = dict(width=96, height=54, soft=AXIS, soft_model="base")


def test_who_takes_long_gives_way():
    """In the middle of an image too small to be cut: others come between, and it ends as if they had not."""
    hold = Hold()
    with Daemon(FAKE, *PATIENT, **hold.environment) as d:
        ended = []
        thread = threading.Thread(target=lambda: ended.append(d.view(**SLOW)))
        thread.start()
        eventually(lambda: d.status()["counters"]["cache_misses"] == 1 and not d.status()["queues"]["render"]["length"])

        def go_on():
            eventually(lambda: d.status()["counters"]["cache_misses"] == 4 and d.status()["queues"]["render"]["length"] == 2)
            hold.allow(3)  # it has given way to the first
        *others, _ = together(4, lambda i: d.view(width=16 + i, height=16) if i < 3 else go_on())
        assert [reply.status for reply in others] == [200] * 3 and not ended, "views of a moment waited for one that takes long"
        hold.allow_all()
        thread.join()
        assert ended[0].status == 200, ended[0].body


def test_blanks_are_plus_in_queries():
    with Daemon(FAKE) as d:
        for text, terms in [("class+%3E0.4", ["class>0.4"]), ("0.1+%3C+class", ["class>0.1"]), ("class:3+-+5", ["class:3..5"]),
                            ("class%3C1e+5", ["class<100000"]), ("class%3C+5+or+class%3E+9", ["class<5", "class>9"])]:
            reply = d.ask(f"{VIEW}?width=8&height=8&soft={text}")
            assert reply.status == 200 and soft(reply)["soft"] == terms, (text, reply.body[:300], reply.headers)
        refused = d.view(width=8, height=8, soft=AXIS, soft_opacity="1.0000000001").json()
        assert "1.0000000001 is not" in refused["detail"], refused


def test_a_batch_says_which_view():
    with Daemon(FAKE) as d:
        batch = d.ask(VIEW + "s", "POST", json.dumps({"width": 8, "height": 8, "views": [{}, {"soft": "nothing_like_it>3"}]}))
        assert batch.status == 400 and batch.json()["field"] == "views[1].soft", batch.body


def test_a_budget_leaves_it_alone():
    with Daemon(FAKE) as d:
        reply = d.ask(f"{VIEW}?width=16&height=16&budget=500ms&soft={AXIS}&soft_opacity=0.9&soft_model=base")
        assert reply.status == 200 and reply.headers["Splatd-Chosen"], reply.headers
        assert soft(reply) == {"soft": [AXIS], "soft_model": "base", "soft_opacity": 0.9, "soft_cover": 1,
                               "soft_blend": 0, "of": "solid"}


def test_a_device_that_is_lost_among_soft_spheres():
    with Daemon(REAL, "--cache", "0", SPLATD_INJECT_LOSS_AFTER="1") as d:
        query = f"{VIEW}?width=64&height=48&soft=plane:0,0,0,0,0,1>0&format=png".replace(">", "%3E")
        whole, lost = d.ask(query), d.ask(query)  # the first part that is run is the counting of what is soft
        assert whole.status == 200 and lost.status == 503, (whole.status, lost.status)
        assert lost.json()["type"] == "urn:splatd:error:device-lost" and lost.headers["Retry-After"], lost.headers
        again = d.ask(query)
        assert again.status == 200 and again.body == whole.body
        assert d.status()["counters"]["device_losses"] == 1


def test_a_dataset_says_what_may_be_soft():
    with Daemon(REAL) as d:
        info = d.ask("/v1/datasets/wall").json()
        kinds = {a["name"]: a["values"] and a["values"]["kinds"] for a in info["attributes"]}
        assert {"axis", "plane", "box"} <= {term.partition(":")[0] for term in info["soft"]}, info["soft"]
        assert not any(term.startswith(f"{name}>q") for term in info["soft"] for name in kinds if kinds[name]), "names are no numbers"
        for term in info["soft"]:
            reply = d.view(width=64, height=48, soft=term)
            assert reply.status == 200 and int(reply.headers["Splatd-Soft-Drawn"]) >= 0, term
        for attribute in info["attributes"]:
            values, name = attribute["values"], attribute["name"]
            if values:
                rising = values["quantiles"]
                assert rising == sorted(rising) and rising[0] <= values["p99"] <= rising[-1], attribute
                assert values["kinds"] is None or sum(k["count"] for k in values["kinds"]) == values["count"] > 0, attribute
            else:  # a file from before
                assert d.view(width=8, height=8, soft=f"{name}>q0.5").json()["field"] == "soft"


def test_it_counts_where_something_is_soft():
    with Daemon(REAL) as d:
        def tag(query):
            return d.ask(f"{VIEW}?width=16&height=16&{query}", "HEAD").headers["ETag"]
        assert tag("soft_opacity=0.9&soft_cover=0.5&soft_model=layer&of=first") == tag("")
        tags = [tag(query) for query in ("", f"soft={AXIS}", f"soft={AXIS}&soft_opacity=0.9", f"soft={AXIS}&soft_cover=0.5", f"soft={AXIS}&soft_model=base",
                                         f"soft={AXIS}&method=points", f"layer=id&soft={AXIS}", f"layer=id&soft={AXIS}&of=first",
                                         f"layer=id&soft={AXIS}&of=median", "soft=class>0.5")]
        assert len(set(tags)) == len(tags), tags
        assert tag("soft=class>0.50") == tags[-1] and tag("soft=.5<class") == tags[-1]


def test_how_much_is_soft_is_said():
    with Daemon(REAL) as d:
        def drawn(**query):
            reply = d.view(width=64, height=48, **query)
            assert reply.status == 200, reply.body
            return reply.headers["Splatd-Soft-Drawn"]
        plane = "plane:0,0,1,0,0,1>0"
        assert int(drawn(soft=plane)) > 100 > 0 == int(drawn(soft="class:77")) == int(drawn(soft="plane:0,0,1e6,0,0,1>0"))
        assert int(drawn(soft=plane, layer="coverage")) == int(drawn(soft=plane)) == int(drawn(soft=plane, layer="depth", of="first"))
        assert drawn() is drawn(soft=plane, soft_opacity=0) is drawn(soft=plane, layer="depth") is None, "none could be"
        assert d.view(width=64, height=48, soft=plane).headers["Splatd-Soft-Drawn"] == drawn(soft=plane)  # of the cache, too


def test_numbers_are_as_they_were_asked_for():
    with Daemon(FAKE) as d:
        reply = d.view(width=8, height=8, soft="class:3", soft_opacity=0.2, soft_cover=0.7, soft_blend=0.1, eye="0.1,0.2,0.3")
        assert '"soft_opacity":0.2,"soft_cover":0.7,"soft_blend":0.1,' in reply.headers["Splatd-Soft"], reply.headers["Splatd-Soft"]
        assert '"eye":[0.1,0.2,0.3]' in reply.headers["Splatd-Camera"], reply.headers["Splatd-Camera"]
        assert re.search(r'"default": 0\.3\b', d.ask("/v1/methods").body.decode())


def test_a_dataset_is_asked_for_what_it_has():
    with Daemon(FAKE) as d:
        for term, hint in [("clas:5", "'class'"), ("class:vegetation", "3-5"), ("class=5", "class:5")]:
            reply = d.view(soft=term)
            assert reply.status == 400 and hint in reply.json()["detail"], reply.body
        had = [a["name"] for a in d.ask("/v1/datasets/wall").json()["attributes"]]
        for query in ["soft=smell>1", "soft=class>1+or+smell>1", "soft=smell>1&budget=500ms"]:
            reply = d.ask(f"{VIEW}?{query}")
            assert reply.status == 400 and reply.json()["field"] == "soft", reply.body
            assert "'smell'" in reply.json()["detail"] and all(name in reply.json()["detail"] for name in had), reply.body
        assert d.ask(f"{PICK}?x=1&y=1&soft=smell>1").json()["field"] == "soft"
        reply = d.ask(VIEW + "s", "POST", json.dumps({"views": [{"soft": "smell>1", "width": 8}]}))
        assert b"smell" in reply.body
        long = " or ".join(["axis:-1.2345678901234567,500000.12345678901,0.12345678901234,0,0,1<0.12345678901234"] * 16)
        reply = d.ask(f"{VIEW}?width=8&height=8&soft={long.replace(' ', '+')}")
        assert reply.status == 200 and len(soft(reply)["soft"]) == 16


run(globals())
