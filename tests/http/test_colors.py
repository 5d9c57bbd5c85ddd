"""What colours show, and their shading, over HTTP: by every route, in ETags only where they change something, refused by
field; and legends."""
import json
import xml.etree.ElementTree as ET

from harness import FAKE, REAL, VIEW, Daemon, run

LEGEND = VIEW.replace("/view", "/legend.svg")
SMALL = "width=32&height=24&format=png"


def test_every_route_takes_them():
    with Daemon(REAL) as d:
        plain = d.ask(f"{VIEW}?{SMALL}")
        seen = {plain.body}
        for query, body in [("color_by=class", {"color_by": "class"}),
                            ("color_by=height&ramp=turbo", {"color_by": "height", "ramp": "turbo"}),
                            ("color_by=class&range=0..200", {"color_by": "class", "range": "0..200"}),
                            ("color_by=rgb%2Bheight", {"color_by": "rgb+height"}),
                            ("color_by=plane:0,0,1,0,0,1&range=-1..1", {"color_by": "plane:0,0,1,0,0,1", "range": "-1..1"}),
                            ("color_by=normal", {"color_by": "normal"}), ("color_by=flat:ff8000", {"color_by": "flat:ff8000"}),
                            ("shade=headlight", {"shade": "headlight"}), ("shade=sun:30,20", {"shade": "sun:30,20"}),
                            ("shade=edl%2Bsun:200,70&edl_strength=1&edl_radius=5",  # of a wall the sun alone makes a difference
                             {"shade": "edl+sun:200,70", "edl_strength": 1, "edl_radius": 5})]:
            got = d.ask(f"{VIEW}?{SMALL}&{query}")
            assert got.status == 200, got.body
            seen.add(got.body)
            posted = d.post({"width": 32, "height": 24, "format": "png", **body})
            assert posted.headers["Splatd-Cache"] == "hit" and posted.body == got.body, query
        assert len(seen) == 11
        assert d.ask(f"{VIEW}?{SMALL}&shade=edl+headlight").status == 200  # + is a blank in forms
        batch = {"width": 32, "height": 24, "format": "png", "color_by": "height", "shade": "headlight",
                 "views": [{}, {"ramp": "turbo"}, {"color_by": "flat:red", "shade": "none"}, {"color_by": "rgb", "shade": "none"}]}
        reply = d.ask(VIEW + "s", "POST", json.dumps(batch))
        assert reply.status == 200 and plain.body in reply.body
        assert d.ask(f"{VIEW}?{SMALL}&color_by=class&budget=500ms").status == 200


def test_they_count_where_they_change_something():
    with Daemon(REAL) as d:
        def tag(query):
            return d.ask(f"{VIEW}?{SMALL}&{query}", "HEAD").headers["ETag"]
        for query in ["shade=none", "shade=auto", "edl_strength=1&edl_radius=4", "color_by=rgb", "ramp=turbo&range=0..1"]:
            assert tag(query) == tag(""), query
        assert tag("layer=depth&shade=edl&color_by=class") == tag("layer=depth")
        for even, shade in (("color_by=class", "edl"), ("color_by=flat:red", "edl%2Bheadlight")):  # which show no shape by themselves
            assert tag(even) == tag(f"{even}&shade={shade}") != tag(even + "&shade=none"), even
        assert tag("color_by=height") == tag("color_by=height&shade=none")
        assert tag("shade=edl&edl_radius=2") == tag("shade=edl") and tag("color_by=plane:0,0,1,0,0,1.0") == tag("color_by=plane:0,0,1,0,0,1")
        queries = ["", "shade=edl", "shade=edl&edl_radius=3", "shade=sun:1,2", "shade=sun:1,3", "color_by=class", "color_by=height",
                   "color_by=height&ramp=turbo", "color_by=height&range=0..1", "color_by=height&range=0..2", "color_by=rgb%2Bheight",
                   "color_by=flat:red", "color_by=flat:blue"]
        tags = [tag(query) for query in queries]
        assert len(set(tags)) == len(tags), tags


def test_what_is_wrong_is_named():
    with Daemon(FAKE) as d:
        for query, field, says in [("shade=glow", "shade", "glow"), ("shade=none%2Bedl", "shade", "none+edl"), ("shade=sun:1", "shade", "sun"),
                                   ("edl_strength=2", "edl_strength", "2"), ("edl_radius=6", "edl_radius", "6"),
                                   ("edl_radius=1.5", "edl_radius", "1.5"), ("color_by=smell", "color_by", "it has class"),
                                   ("color_by=hieght", "color_by", "and any has rgb, height, normal, plane: and flat:"),
                                   ("color_by=smell&budget=500ms", "color_by", "smell"), ("color_by=plane:1,2", "color_by", "plane:1,2"),
                                   ("color_by=", "color_by", "empty"), ("color_by=class&color_by=height", "color_by", "color_by"),
                                   ("color_by=height&ramp=jet", "ramp", "jet"),
                                   ("color_by=height&range=5", "range", "5"), ("color_by=plane:0,0,0,0,0,1&range=q0..q1", "range", "quantiles"),
                                   ("color_by=class&range=2..1", "range", "2..1"), ("color_by=height&range=-1e308..1e308", "range", "wider"),
                                   ("color_by=" + "x" * 500, "color_by", "")]:
            reply = d.ask(f"{VIEW}?{query}")
            problem = reply.json()
            assert reply.status == 400 and problem["field"] == field and says in problem["detail"], (query, reply.body)
        for body, field in [({"color_by": 5}, "color_by"), ({"shade": ["edl"]}, "shade"), ({"range": [0, 1]}, "range")]:
            reply = d.post(body)
            assert reply.status == 400 and reply.json()["field"] == field, reply.body
        pick = d.ask(VIEW.replace("/view", "/pick") + "?x=1&y=1&shade=edl")
        assert pick.status == 400 and pick.json()["field"] == "shade", pick.body


def test_a_legend_says_what_colours_mean():
    with Daemon(FAKE) as d:
        def texts(query):
            reply = d.ask(f"{LEGEND}?{query}")
            assert reply.status == 200 and reply.headers["Content-Type"] == "image/svg+xml", reply.body
            return [t.text for t in ET.fromstring(reply.body).iter("{http://www.w3.org/2000/svg}text")]
        assert texts("color_by=class&range=0..200") == ["class", "0", "50", "100", "150", "200"]
        assert texts("color_by=height&range=-1..1&ramp=grey")[1:] == ["-1", "-0.5", "0", "0.5", "1"]
        assert texts("color_by=height&range=1.23456..9.87654")[1:] == ["1.2346", "5.5556", "9.8765"]  # more would touch
        assert texts("color_by=height&range=500000..500010")[1:] == ["500000", "500005", "500010"]
        assert texts("color_by=height&range=1714564800..1714564801")[1:] == ["1714564800", "1714564801"]  # seconds of a day
        assert texts("color_by=height")[0].startswith("height (")
        assert texts("color_by=class")[0] == "class" and len(texts("color_by=class")) > 1
        assert texts("color_by=normal") == ["normal", "x", "y", "z"]
        assert texts("color_by=flat:red") == ["flat", "flat:ff0000"]
        for query, field in [("", "color_by"), ("color_by=rgb", "color_by"), ("color_by=smell", "color_by"), ("color_by=class&width=5", "width"),
                             ("color_by=class&ramp=jet", "ramp"), ("color_by=plane:0,0,0,0,0,1&range=q0..q1", "range")]:
            reply = d.ask(f"{LEGEND}?{query}")
            assert reply.status == 400 and reply.json()["field"] == field, (query, reply.body)
        assert d.ask(LEGEND.replace("wall", "hall") + "?color_by=class").status == 404


run(globals())
