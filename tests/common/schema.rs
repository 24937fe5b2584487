//! Holds a JSON value to a JSON Schema, for the part of that language that `docs/schema` uses:
//! type, enum, minimum, properties, required, additionalProperties, items, and $ref to $defs.
//!
//! A keyword that it does not know is a fault of the schema, so none is passed over in silence.

use serde_json::{Map, Value};

const KNOWN: [&str; 13] = [
    "$schema",
    "title",
    "description",
    "$defs",
    "$ref",
    "type",
    "enum",
    "minimum",
    "properties",
    "required",
    "additionalProperties",
    "items",
    "$id",
];

/// Whatever in `value` is not as `schema` demands, with its place.
pub fn faults(schema: &Value, value: &Value) -> Vec<String> {
    let mut found = Vec::new();
    judge(schema, schema, value, "$", &mut found);
    found
}

fn judge(root: &Value, schema: &Value, value: &Value, at: &str, found: &mut Vec<String>) {
    let Some(rules) = schema.as_object() else {
        found.push(format!("{at}: a schema that is no object: {schema}"));
        return;
    };
    for word in rules.keys().filter(|word| !KNOWN.contains(&word.as_str())) {
        found.push(format!("{at}: a schema with the unknown keyword '{word}'"));
    }
    if let Some(target) = rules.get("$ref") {
        let name = target.as_str().and_then(|t| t.strip_prefix("#/$defs/"));
        match name.and_then(|name| root["$defs"].get(name)) {
            Some(target) => judge(root, target, value, at, found),
            None => found.push(format!("{at}: a reference to nothing: {target}")),
        }
    }
    if let Some(types) = rules.get("type") {
        let types: Vec<&Value> = match types {
            Value::Array(types) => types.iter().collect(),
            one => vec![one],
        };
        if !types.iter().any(|t| is(value, t.as_str().unwrap_or(""))) {
            found.push(format!("{at}: {value} is not of type {types:?}"));
            return;
        }
    }
    let allowed = rules.get("enum").and_then(Value::as_array);
    if allowed.is_some_and(|allowed| !allowed.contains(value)) {
        found.push(format!("{at}: {value} is not among {allowed:?}"));
    }
    if let (Some(least), Some(number)) = (rules.get("minimum"), value.as_f64())
        && least.as_f64().is_none_or(|least| number < least)
    {
        found.push(format!("{at}: {value} is below {least}"));
    }
    if let Some(object) = value.as_object() {
        keys(root, rules, object, at, found);
    }
    if let (Some(items), Some(list)) = (rules.get("items"), value.as_array()) {
        for (i, item) in list.iter().enumerate() {
            judge(root, items, item, &format!("{at}[{i}]"), found);
        }
    }
}

fn keys(
    root: &Value,
    rules: &Map<String, Value>,
    object: &Map<String, Value>,
    at: &str,
    found: &mut Vec<String>,
) {
    let required = rules.get("required").and_then(Value::as_array);
    for key in required.into_iter().flatten().filter_map(Value::as_str) {
        if !object.contains_key(key) {
            found.push(format!("{at}: no key '{key}'"));
        }
    }
    let properties = rules.get("properties").and_then(Value::as_object);
    for (key, value) in object {
        let at = format!("{at}.{key}");
        match (
            properties.and_then(|p| p.get(key)),
            rules.get("additionalProperties"),
        ) {
            (Some(schema), _) => judge(root, schema, value, &at, found),
            (None, Some(Value::Bool(false))) => found.push(format!("{at}: an unknown key")),
            (None, None | Some(Value::Bool(true))) => {}
            (None, Some(schema)) => judge(root, schema, value, &at, found),
        }
    }
}

fn is(value: &Value, name: &str) -> bool {
    match name {
        "null" => value.is_null(),
        "boolean" => value.is_boolean(),
        "integer" => value.is_u64() || value.is_i64(),
        "number" => value.is_number(),
        "string" => value.is_string(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        _ => false,
    }
}
