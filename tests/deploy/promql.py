"""As much of PromQL as it takes to say which metrics and labels an expression names."""
import re

WORDS = set("by without on ignoring group_left group_right and or unless bool offset sum count avg min max rate "
            "increase delta absent changes histogram_quantile avg_over_time max_over_time round".split())
TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|\'(?:[^\'\\]|\\.)*\'|\[[^\]]*\]|[a-zA-Z_:][\w:]*|=~|!~|!=|\d[\w.]*|\S')


def named(expression):
    """[(metric, {label: value where it is matched by =, else None})], {labels of by, on, …}; ValueError for a word
    that is no metric of ours, none of Prometheus' and no function."""
    tokens = TOKEN.findall(expression)
    selectors, labels, i = [], set(), 0
    while i < len(tokens):
        token = tokens[i]
        if token in ("by", "without", "on", "ignoring", "group_left", "group_right") and tokens[i + 1:i + 2] == ["("]:
            end = tokens.index(")", i)
            labels |= set(tokens[i + 2:end]) - {","}
            i = end
        elif re.match(r"[a-zA-Z_:]", token) and (re.match(r"(splatd|process|up$)", token) or ":" in token):
            matchers = {}
            if tokens[i + 1:i + 2] == ["{"]:
                end = tokens.index("}", i)
                for label, operator, value in zip(*[iter(t for t in tokens[i + 2:end] if t != ",")] * 3):
                    matchers[label] = value[1:-1] if operator == "=" else None
                i = end
            selectors.append((token, matchers))
        elif re.match(r"[a-zA-Z_:]", token) and token not in WORDS:
            raise ValueError(f"'{token}' is neither a metric nor a function: {expression}")
        i += 1
    if not selectors:
        raise ValueError(f"no metric: {expression}")
    return selectors, labels
