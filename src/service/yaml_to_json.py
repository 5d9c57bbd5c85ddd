"""A YAML file as JSON, for meson. usage: yaml_to_json.py IN OUT"""
import json
import sys

import yaml

with open(sys.argv[1], encoding="utf-8") as source, open(sys.argv[2], "w", encoding="utf-8") as out:
    json.dump(yaml.safe_load(source), out, ensure_ascii=False)
