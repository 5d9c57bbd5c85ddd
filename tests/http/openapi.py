"""What api/openapi.yaml promises, held against every request and reply of the HTTP tests.

A reply must have a documented status, type, headers and schema; a request that succeeds must be one that the document
allows. What was used is noted, and test_openapi.py fails for what is documented and never used. In the document, `x-everywhere`
on a header in components/headers says that every reply carries it, and "Alias X." in a parameter's description that X is
another name for it, in any case of letters."""
import functools
import json
import os
import pathlib
import re
import urllib.parse

import jsonschema
import yaml

PATH = pathlib.Path(os.environ["SPLATD_SOURCE_ROOT"]) / "api" / "openapi.yaml"


class Strict(yaml.SafeLoader):
    """Refuses a key that stands twice in a mapping, where YAML would take the last."""

    def construct_mapping(self, node, deep=False):
        keys = [self.construct_object(key, deep=True) for key, _ in node.value]
        twice = [key for key in keys if keys.count(key) > 1]
        assert not twice, f"api/openapi.yaml, line {node.start_mark.line + 1}: {twice[0]} stands twice below"
        return super().construct_mapping(node, deep)


DOCUMENT = yaml.load(PATH.read_text(encoding="utf-8"), Strict)
METHODS = ("get", "put", "post", "delete", "options", "patch")
# Of the protocol or of any server; the document need not name them.
PLAIN_HEADERS = {"content-type", "content-length", "connection", "date", "transfer-encoding",
                 "vary", "access-control-allow-origin", "access-control-expose-headers"}  # with --cors
NEWS = "; document it in api/openapi.yaml, or mend the daemon or the test"


def resolve(node):
    while isinstance(node, dict) and "$ref" in node:
        target = DOCUMENT
        for name in node["$ref"].removeprefix("#/").split("/"):
            target = target[name.replace("~1", "/").replace("~0", "~")]
        node = target
    return node


@functools.lru_cache(maxsize=None)
def _validator(text):
    return jsonschema.Draft202012Validator({**json.loads(text), "components": DOCUMENT["components"]})


def faults(schema, value):
    """What is wrong with `value`, as lines; none when nothing is."""
    validator = _validator(json.dumps(schema))
    return [f"{'/'.join(map(str, e.absolute_path)) or 'it'}: {e.message[:300]}" for e in validator.iter_errors(value)]


def readings(text):
    """What a text in a query or a header may mean."""
    yield text
    if text in ("true", "false"):
        yield text == "true"
    for kind in (int, float):
        try:
            yield kind(text)
        except ValueError:
            pass
    yield text.split(",")


def text_faults(schema, text):
    return [] if any(not faults(schema, value) for value in readings(text)) else [f"'{text}' is none of {schema}"]


def operations():
    """(template, method, operation, parameters) of each."""
    for template, item in DOCUMENT["paths"].items():
        for method in METHODS:
            if method in item:
                operation = item[method]
                parameters = [resolve(p) for p in item.get("parameters", []) + operation.get("parameters", [])]
                yield template, method, operation, parameters


@functools.lru_cache(maxsize=None)
def _templates():
    """Those without holes first, as the standard says."""
    found = [(re.compile(re.sub(r"\\{\w+\\}", "[^/]+", re.escape(t)) + r"\Z"), t) for t in DOCUMENT["paths"]]
    return sorted(found, key=lambda row: row[1].count("{"))


def template_of(path):
    return next((template for pattern, template in _templates() if pattern.match(path)), None)


def names_of(parameter):
    """The parameter's name and, lower case, its alias."""
    alias = re.search(r"\bAlias (\w+)\.", parameter.get("description", ""))
    return parameter["name"], alias and alias.group(1).lower()


def find_parameter(parameters, place, name):
    for parameter in parameters:
        own, alias = names_of(parameter)
        if parameter["in"] == place and (own == name or alias == name.lower()
                                         or place == "header" and own.lower() == name.lower()):
            return parameter
    return None


def properties_in(schema, value, prefix=""):
    """Names of the documented members that `value` has, nested ones as a.b."""
    schema = resolve(schema)
    for part in schema.get("allOf", []) + schema.get("oneOf", []) + schema.get("anyOf", []):
        yield from properties_in(part, value, prefix)
    if isinstance(value, list) and "items" in schema:
        for item in value:
            yield from properties_in(schema["items"], item, prefix)
    if isinstance(value, dict):
        for name in set(value) & set(schema.get("properties", {})):
            yield prefix + name
            yield from properties_in(schema["properties"][name], value[name], f"{prefix}{name}.")


def all_properties(schema, prefix="", depth=0, beside={}):
    """But for those that stand as `false` beside a $ref, or in `beside`, which says so of what lies deeper."""
    beside = beside or schema.get("properties", {}) if "$ref" in schema else beside
    schema = resolve(schema)
    for part in schema.get("allOf", []) + schema.get("oneOf", []) + schema.get("anyOf", []):
        yield from all_properties(part, prefix, depth, beside)
    if "items" in schema:
        yield from all_properties(schema["items"], prefix, depth)
    for name, inner in schema.get("properties", {}).items():
        if beside.get(name) is False:
            continue
        yield prefix + name
        if depth < 4:
            yield from all_properties(inner, f"{prefix}{name}.", depth + 1, beside.get(name, {}).get("properties", {}))


used = set()  # "GET /v1/x", "GET /v1/x -> 200", "GET /v1/x ?name", "GET /v1/x body name"


def check_request(where, operation, parameters, query, headers, body):
    """Of a request that has succeeded: what it used is documented."""
    if headers.get("Authorization") is None:  # the security scheme signedUrl
        query = re.sub(r"(^|&)exp=\d+&(sig|embed)=[\w-]{43}\Z", "", query)
    for name, text in urllib.parse.parse_qsl(query.replace("+", "%2B"), keep_blank_values=True):
        parameter = find_parameter(parameters, "query", name)
        assert parameter, f"{where} takes '?{name}', which is not documented{NEWS}"
        wrong = text_faults(parameter.get("schema", {}), text)
        assert not wrong, f"{where} takes ?{name}={text}, but the document says: {wrong}{NEWS}"
        used.add(f"{where} ?{parameter['name']}")
    for name in headers:
        if parameter := find_parameter(parameters, "header", name):
            used.add(f"{where} header {parameter['name']}")
    schema = operation.get("requestBody", {}).get("content", {}).get("application/json", {}).get("schema")
    if schema and body and headers.get("Content-Type") == "application/json":
        document = json.loads(body)
        wrong = faults(schema, document)
        assert not wrong, f"{where} takes a body that the document refuses: {wrong}; body {body[:300]}{NEWS}"
        used.update(f"{where} body {name}" for name in properties_in(schema, document))


def check_body(where, content, reply):
    kind = (reply.headers["Content-Type"] or "").split(";")[0]
    assert kind in content or not content and not reply.body, f"{where}: type '{kind}' is not among {list(content)}{NEWS}"
    schema = content.get(kind, {}).get("schema")
    if schema and kind.endswith("json") and reply.body:
        wrong = faults(schema, reply.json())
        assert not wrong, f"{where}: the body differs from its schema: {wrong}{NEWS}"


def check_headers(where, documented, reply):
    everywhere = {name: header for name, header in DOCUMENT["components"].get("headers", {}).items()
                  if header.get("x-everywhere")}
    known = {name.lower(): resolve(header) for name, header in {**documented, **everywhere}.items()}
    for name, text in reply.headers.items():
        if name.lower() in PLAIN_HEADERS:
            continue
        assert name.lower() in known, f"{where}: header {name}: {text} is not documented{NEWS}"
        header = known[name.lower()]
        if "content" in header:
            wrong = faults(header["content"]["application/json"]["schema"], json.loads(text))
        else:
            wrong = text_faults(header.get("schema", {}), text)
        assert not wrong, f"{where}: header {name}: {wrong}{NEWS}"
    for name, header in known.items():
        assert name in reply.headers or not (header.get("required") or header.get("x-everywhere")), \
            f"{where}: header {name} is missing"


def check(method, target, headers, body, reply):
    path, _, query = target.partition("?")
    template = template_of(path)
    method = "get" if method == "HEAD" else method.lower()
    row = next((o for o in operations() if o[:2] == (template, method)), None)
    if method == "options" and reply.status == 204 and headers.get("Access-Control-Request-Method"):
        return  # what --cors answers browsers; test_access.py looks at it
    if not row:  # nothing here, or not this method: the reply must say so
        assert reply.status >= 400, f"{method.upper()} {path} gives {reply.status} and is not documented{NEWS}"
        problem = DOCUMENT["components"]["responses"]["Problem"]
        check_headers(f"{method.upper()} {path} -> {reply.status}", problem.get("headers", {}), reply)
        check_body(f"{method.upper()} {path} -> {reply.status}", problem["content"], reply)
        return
    _, _, operation, parameters = row
    where = f"{method.upper()} {template}"
    responses = operation["responses"]
    status = next((s for s in (str(reply.status), f"{reply.status // 100}XX") if s in responses), None)
    assert status, f"{where} gives {reply.status}, which is not documented; {reply.body[:300]}{NEWS}"
    response = resolve(responses[status])
    used.update((where, f"{where} -> {status}"))
    check_headers(f"{where} -> {reply.status}", response.get("headers", {}), reply)
    check_body(f"{where} -> {reply.status}", response.get("content", {}), reply)
    if reply.status < 400:
        check_request(where, operation, parameters, query, headers, body)


def documented():
    """What there is to use, in the words of `used`."""
    for template, method, operation, parameters in operations():
        where = f"{method.upper()} {template}"
        yield where
        for status in operation["responses"]:
            yield f"{where} -> {status}"
        for parameter in parameters:
            if parameter["in"] in ("query", "header"):
                yield f"{where} {'?' if parameter['in'] == 'query' else 'header '}{parameter['name']}"
        content = operation.get("requestBody", {}).get("content", {})
        if "application/json" in content:
            for name in all_properties(content["application/json"]["schema"]):
                yield f"{where} body {name}"


def save(name):
    """Leaves what this program has used for test_openapi.py."""
    folder = pathlib.Path(os.environ["SPLATD_EXERCISED"])
    folder.mkdir(exist_ok=True)
    (folder / f"{name}.json").write_text(json.dumps(sorted(used)))
