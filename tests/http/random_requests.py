"""Random requests of every route that api/openapi.yaml has, mostly allowed by it; of test_reliability.py and mutating/."""
import json
import re

import openapi

HOSTILE = ["", "0", "-1", "1e999", "nan", "inf", "null", "true", "a", "1,2,3", "1,2", "0,0,0", "%00", "%ff", "%zz", "../..",
           "'\"<>", "9" * 400, "1e-320", "18446744073709551616", "{}", "[]", "x" * 3000, "&", "=", "%25", "é", "splat", "jpeg"]


def random_number(r, schema):
    low = schema.get("minimum", schema.get("exclusiveMinimum", -20))
    high = min(schema.get("maximum", 60), 60 if schema.get("type") == "integer" else 1e9)
    value = r.choice([low, high, r.uniform(low, min(high, low + 50))])
    return int(value) if schema.get("type") == "integer" else value


def random_value(r, schema, depth=0):
    """A value that is allowed by the schema, mostly."""
    schema = openapi.resolve(schema)
    if r.random() < 0.06:
        return r.choice(HOSTILE + [None, -1, 1e300, [], {}, [1, 2, 3], {"a": 1}, True])
    for way in ("oneOf", "anyOf", "allOf"):
        if way in schema:
            return random_value(r, r.choice(schema[way]), depth)
    if "enum" in schema or "const" in schema:
        return r.choice(schema.get("enum") or [schema["const"]])
    kind = schema.get("type", "string")
    kind = r.choice(kind) if isinstance(kind, list) else kind
    if kind in ("number", "integer"):
        return random_number(r, schema)
    if kind == "boolean":
        return r.random() < 0.5
    if kind == "array":
        count = r.randint(schema.get("minItems", 0), min(schema.get("maxItems", 4), schema.get("minItems", 0) + 3))
        return [random_value(r, schema.get("items", {}), depth + 1) for _ in range(count)]
    if kind == "object":
        share = 0.25 if depth else 0.15
        return {name: random_value(r, inner, depth + 1) for name, inner in schema.get("properties", {}).items()
                if name in schema.get("required", []) or r.random() < share}
    pattern = schema.get("pattern", "")
    if ",[^,]+" in pattern:
        return ",".join(str(r.choice([r.randint(-9, 9), r.uniform(-9, 9)])) for _ in range(3))
    if "examples" in schema:
        return r.choice(schema["examples"])
    return r.choice(["5ms", "ff0000", "transparent", "wall", "1"])


def as_text(value):
    if isinstance(value, bool):
        return str(value).lower()
    return value if isinstance(value, str) else json.dumps(value) if isinstance(value, (dict, type(None))) else \
        ",".join(map(str, value)) if isinstance(value, list) else repr(value)


def random_request(r):
    """(method, target, headers, body) that urllib would not let anybody write."""
    template, method, operation, parameters = r.choice(list(openapi.operations()))
    if r.random() < 0.5:
        template, method, operation, parameters = r.choice([o for o in openapi.operations() if o[0].endswith("/view")])
    path = re.sub(r"\{(\w+)\}", lambda m: r.choice(["wall"] * 8 + ["none", "..", "%2e%2e", "a%2fb", "%ff", "%00", "x" * 300])
                  if m[1] == "id" else r.choice(["wall", "main.js", "1", "none", "%2f"]), template)
    chosen = [p for p in parameters if p["in"] == "query" and r.random() < 0.2]
    pairs = [(r.choice([n for n in openapi.names_of(p) if n]), as_text(random_value(r, p.get("schema", {})))) for p in chosen]
    if method == "get" and "view" in template and r.random() < 0.9:
        pairs = [p for p in pairs if p[0] not in ("width", "height")] + [("width", r.choice("1 16 33".split())), ("height", "9")]
    if r.random() < 0.1:
        pairs.append((r.choice(HOSTILE), r.choice(HOSTILE)))
    if r.random() < 0.05:
        pairs.append(r.choice(pairs or [("width", "5")]))
    query = "&".join(f"{quote(r, name)}={quote(r, text)}" for name, text in pairs)
    headers = {p["name"]: r.choice(['*', '"x"', "", "W/" * 50]) for p in parameters if p["in"] == "header" and r.random() < 0.3}
    schema, body = operation.get("requestBody", {}).get("content", {}).get("application/json", {}).get("schema"), None
    if schema:
        document = random_value(r, schema)
        if isinstance(document, dict) and "view" in template and r.random() < 0.9:
            document.update(width=16, height=9)
            if isinstance(document.get("camera"), dict):
                document["camera"] = {k: v for k, v in document["camera"].items() if k not in ("width", "height")}
        body = json.dumps(document).encode()
        headers["Content-Type"] = "application/json"
        if r.random() < 0.1:
            spot = r.randrange(len(body) + 1)
            body = body[:spot] + bytes([r.randrange(256)]) + body[spot + r.randrange(2):]
    name = r.choice([method.upper()] * 12 + ["HEAD", "POST", "PUT", "DELETE", "PATCH", "BREW"])
    return name, path + ("?" + query if query else ""), headers, body


def quote(r, text):
    """Percent-encodes what cannot stand in a request line, and now and then nothing else."""
    bare = r.random() < 0.5
    return "".join(c if c.isascii() and c.isalnum() or c in "-._~,%" or (bare and c in "'\"<>{}[]&=") else
                   "".join(f"%{b:02x}" for b in c.encode()) for c in text)
