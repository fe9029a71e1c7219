//! The text of Open Inventor, VRML 1 and VRML 97: a tree of nodes with fields. It needs no list of the kinds of nodes.
//!
//! A node is `Kind { field value … Child { … } … }`. `DEF name` before it gives it a name, `USE name` means the same node
//! again. Commas are spaces.

use std::collections::HashMap;

/// Nodes inside each other.
pub(super) const MAX_DEPTH: usize = 128;
/// Nodes, words and texts of a file.
const MAX_ITEMS: usize = 200_000;
/// Numbers of a file: those of the largest mesh that is read, with its indices.
const MAX_NUMBERS: usize = 30_000_000;

/// A node of a [`Tree`].
#[derive(Debug, Default)]
pub(super) struct Node {
    pub(super) kind: String,
    fields: Vec<(String, Value)>,
    /// Nodes in its braces that are no field's value.
    pub(super) children: Vec<usize>,
}

/// The value of a field: its numbers, words and nodes, each in order.
#[derive(Debug, Default)]
pub(super) struct Value {
    pub(super) numbers: Vec<f64>,
    /// Texts in quotes, and names such as `TRUE` or `CLOCKWISE`.
    pub(super) words: Vec<String>,
    pub(super) nodes: Vec<usize>,
}

/// All nodes of a file. They name each other by index, so that a long chain of `USE` is no deep structure.
#[derive(Debug, Default)]
pub(super) struct Tree {
    nodes: Vec<Node>,
    /// The nodes outside all others.
    pub(super) roots: Vec<usize>,
}

impl Tree {
    pub(super) fn node(&self, index: usize) -> &Node {
        &self.nodes[index]
    }

    /// The numbers in a node, and in the nodes in its fields.
    pub(super) fn size(&self, index: usize) -> usize {
        let own = |node: &Node| node.fields.iter().map(|(_, value)| value.numbers.len()).sum::<usize>();
        let node = self.node(index);
        let parts = node.fields.iter().flat_map(|(_, value)| &value.nodes).chain(&node.children);
        own(node) + parts.map(|&part| own(self.node(part))).sum::<usize>()
    }
}

impl Node {
    /// The value of a field. One that appears twice has its last value.
    pub(super) fn field(&self, name: &str) -> Option<&Value> {
        self.fields.iter().rev().find(|(field, _)| field == name).map(|(_, value)| value)
    }

    /// The first word of a field.
    pub(super) fn word(&self, name: &str) -> Option<&str> {
        self.field(name)?.words.first().map(String::as_str)
    }

    /// The numbers of a field, if it is there; it must have so many.
    pub(super) fn numbers<const N: usize>(&self, name: &str) -> Result<Option<[f64; N]>, String> {
        let Some(value) = self.field(name) else { return Ok(None) };
        let numbers: Result<[f64; N], _> = value.numbers.as_slice().try_into();
        numbers.map(Some).map_err(|_| {
            format!("has a {} whose {name} has {} numbers instead of {N}", self.kind, value.numbers.len())
        })
    }
}

/// Reads a text.
pub(super) fn parse(text: &str) -> Result<Tree, String> {
    let mut parser = Parser {
        lexer: Lexer { rest: text },
        tree: Tree::default(),
        names: HashMap::new(),
        items: 0,
        numbers: 0,
    };
    while let Some(token) = parser.lexer.peek() {
        match token {
            Token::Word("ROUTE") => parser.route(),
            // Published files have one too many at their end.
            Token::Sign('}') if !parser.tree.roots.is_empty() => drop(parser.next()?),
            Token::Word(_) => {
                let node = parser.node(0)?;
                parser.tree.roots.push(node);
            }
            other => return Err(format!("has {other} where a node is expected")),
        }
    }
    Ok(parser.tree)
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Token<'a> {
    /// One of `{ } [ ] ( ) | =`.
    Sign(char),
    /// In quotes.
    Text(&'a str),
    Word(&'a str),
}

impl std::fmt::Display for Token<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Token::Sign(sign) => write!(f, "'{sign}'"),
            Token::Text(text) | Token::Word(text) => {
                write!(f, "'{}'", text.chars().take(40).collect::<String>().escape_debug())
            }
        }
    }
}

#[derive(Clone, Copy)]
struct Lexer<'a> {
    rest: &'a str,
}

impl<'a> Lexer<'a> {
    fn next(&mut self) -> Option<Token<'a>> {
        const SIGNS: &str = "{}[]()|=";
        // `~` after a value: Inventor ignores the field's connection.
        let space = |c: char| c.is_whitespace() || matches!(c, ',' | '~' | '\0');
        loop {
            self.rest = self.rest.trim_start_matches(space);
            let Some(comment) = self.rest.strip_prefix('#') else { break };
            self.rest = comment.find(['\n', '\r']).map_or("", |end| &comment[end..]);
        }
        let first = self.rest.chars().next()?;
        let after = &self.rest[first.len_utf8()..];
        if SIGNS.contains(first) {
            self.rest = after;
            return Some(Token::Sign(first));
        }
        if first == '"' {
            let mut escaped = false;
            let end = after.find(|c: char| {
                let ends = c == '"' && !escaped;
                escaped = c == '\\' && !escaped;
                ends
            });
            let (text, rest) = end.map_or((after, ""), |end| (&after[..end], &after[end + 1..]));
            self.rest = rest;
            return Some(Token::Text(text));
        }
        let ends = |c: char| space(c) || SIGNS.contains(c) || matches!(c, '"' | '#');
        let (word, rest) = self.rest.split_at(self.rest.find(ends).unwrap_or(self.rest.len()));
        self.rest = rest;
        Some(Token::Word(word))
    }

    fn peek(mut self) -> Option<Token<'a>> {
        self.next()
    }
}

/// The number that a word is; a word such as `nan` is none.
fn number(word: &str) -> Option<Result<f64, String>> {
    if !word.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.')) {
        return None;
    }
    let hexadecimal = word.strip_prefix("0x").or_else(|| word.strip_prefix("0X"));
    let number = match hexadecimal {
        Some(digits) => u64::from_str_radix(digits, 16).ok().map(|x| x as f64),
        None => word.parse().ok(),
    };
    Some(
        number
            .filter(|x: &f64| x.is_finite())
            .ok_or_else(|| format!("has {} where a finite number is expected", Token::Word(word))),
    )
}

struct Parser<'a> {
    lexer: Lexer<'a>,
    tree: Tree,
    /// The last node of each name.
    names: HashMap<&'a str, usize>,
    items: usize,
    numbers: usize,
}

impl<'a> Parser<'a> {
    fn next(&mut self) -> Result<Token<'a>, String> {
        self.lexer.next().ok_or_else(|| "ends too early".to_owned())
    }

    fn item(&mut self) -> Result<(), String> {
        self.items += 1;
        if self.items > MAX_ITEMS {
            Err(format!("has more than {MAX_ITEMS} nodes and words"))
        } else {
            Ok(())
        }
    }

    /// `DEF name Kind { … }`, `Kind { … }`, or `USE name`; its index.
    fn node(&mut self, depth: usize) -> Result<usize, String> {
        if depth > MAX_DEPTH {
            return Err(format!("has more than {MAX_DEPTH} nodes inside each other"));
        }
        self.item()?;
        let mut token = self.next()?;
        let mut name = None;
        if token == Token::Word("DEF") {
            let Token::Word(word) = self.next()? else { return Err("has a DEF without a name".to_owned()) };
            name = Some(word);
            token = self.next()?;
        }
        let kind = match token {
            Token::Word("USE") => {
                let token = self.next()?;
                let used = if let Token::Word(name) = token { self.names.get(name) } else { None };
                return used.copied().ok_or_else(|| format!("uses {token}, which no DEF before it defines"));
            }
            Token::Word(kind @ ("PROTO" | "EXTERNPROTO")) => {
                return Err(format!("has a {kind}, which is not read; save it as STL or OBJ"));
            }
            Token::Word(kind) => kind,
            other => return Err(format!("has {other} where a node is expected")),
        };
        let token = self.next()?;
        if token != Token::Sign('{') {
            return Err(format!("has {token} after '{kind}', where {{ is expected"));
        }
        let mut node = Node { kind: kind.to_owned(), ..Node::default() };
        loop {
            match self.lexer.peek() {
                None => return Err("ends too early".to_owned()),
                Some(Token::Sign('}')) => {
                    self.next()?;
                    break;
                }
                Some(Token::Word("ROUTE")) => self.route(),
                Some(Token::Word(_)) if self.at_node() => node.children.push(self.node(depth + 1)?),
                Some(Token::Word(field)) => {
                    self.next()?;
                    let value = self.value(depth)?;
                    node.fields.push((field.to_owned(), value));
                }
                Some(other) => return Err(format!("has {other} in a {kind}, where a field is expected")),
            }
        }
        let index = self.tree.nodes.len();
        self.tree.nodes.push(node);
        if let Some(name) = name {
            self.names.insert(name, index);
        }
        Ok(index)
    }

    /// Whether a node comes next.
    fn at_node(&self) -> bool {
        let mut ahead = self.lexer;
        match ahead.next() {
            Some(Token::Word("DEF" | "USE" | "PROTO" | "EXTERNPROTO")) => true,
            Some(Token::Word(_)) => ahead.next() == Some(Token::Sign('{')),
            _ => false,
        }
    }

    /// `ROUTE a.b TO c.d`: events move nothing at rest.
    fn route(&mut self) {
        for _ in 0..4 {
            let _ = self.lexer.next();
        }
    }

    fn value(&mut self, depth: usize) -> Result<Value, String> {
        self.item()?;
        let mut value = Value::default();
        match self.lexer.peek() {
            Some(Token::Sign('[')) => {
                self.next()?;
                while self.lexer.peek() != Some(Token::Sign(']')) {
                    match self.lexer.peek() {
                        Some(Token::Sign('(' | ')' | '|')) => drop(self.next()?),
                        Some(Token::Text(_) | Token::Word(_)) => self.part(&mut value, depth)?,
                        Some(other) => return Err(format!("has {other} in a list")),
                        None => return Err("ends too early".to_owned()),
                    }
                }
                self.next()?;
            }
            // `(SIDES | TOP)`
            Some(Token::Sign('(')) => {
                self.next()?;
                loop {
                    match self.next()? {
                        Token::Sign(')') => break,
                        Token::Word(word) | Token::Text(word) => {
                            self.item()?;
                            value.words.push(word.to_owned());
                        }
                        Token::Sign('|') => {}
                        other @ Token::Sign(_) => return Err(format!("has {other} in a list")),
                    }
                }
            }
            Some(Token::Text(_) | Token::Word(_)) => {
                self.part(&mut value, depth)?;
                let numeric = |token| matches!(token, Some(Token::Word(word)) if number(word).is_some());
                while !value.numbers.is_empty() && numeric(self.lexer.peek()) {
                    self.part(&mut value, depth)?;
                }
            }
            _ => {}
        }
        if self.lexer.peek() == Some(Token::Sign('=')) {
            // `= Node . field`: a connection. The value beside it is the one at rest.
            self.next()?;
            self.part(&mut Value::default(), depth)?;
            while matches!(self.lexer.peek(), Some(Token::Word(word)) if word.starts_with('.')) {
                let dot = self.next()?;
                if dot == Token::Word(".") {
                    self.next()?;
                }
            }
        }
        Ok(value)
    }

    /// One number, word, text or node of a value.
    fn part(&mut self, value: &mut Value, depth: usize) -> Result<(), String> {
        if self.at_node() {
            value.nodes.push(self.node(depth + 1)?);
            return Ok(());
        }
        match self.next()? {
            Token::Word(word) => match number(word) {
                Some(number) => {
                    self.numbers += 1;
                    if self.numbers > MAX_NUMBERS {
                        return Err(format!("has more than {MAX_NUMBERS} numbers"));
                    }
                    value.numbers.push(number?);
                }
                None => {
                    self.item()?;
                    value.words.push(word.to_owned());
                }
            },
            Token::Text(text) => {
                self.item()?;
                value.words.push(text.to_owned());
            }
            Token::Sign(_) => {}
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_children_and_names_are_kept() {
        let text = "#Inventor V2.1 ascii\n# a comment } \nDEF top Separator { # another\n renderCaching AUTO\n\
                    Transform { translation 1,2 -3.5e1 rotation 0 0 1 .5 ~ }\n\
                    Cylinder { parts (SIDES | TOP) radius 0x10 }\n\
                    DEF shape Shape { geometry DEF set IndexedFaceSet { coord Coordinate { point [ 0 0 0, 1 0 0 ] } } }\n\
                    Info { string \"a \\\" } b\" } USE shape }\nROUTE a.b TO c.d\nUSE top";
        let tree = parse(text).expect("a tree");
        assert_eq!(tree.roots.len(), 2);
        assert_eq!(tree.roots[0], tree.roots[1]);
        let top = tree.node(tree.roots[0]);
        assert_eq!((top.kind.as_str(), top.word("renderCaching")), ("Separator", Some("AUTO")));
        let kinds: Vec<&str> = top.children.iter().map(|&child| tree.node(child).kind.as_str()).collect();
        assert_eq!(kinds, ["Transform", "Cylinder", "Shape", "Info", "Shape"]);
        let moved = tree.node(top.children[0]);
        assert_eq!(moved.numbers("translation"), Ok(Some([1.0, 2.0, -35.0])));
        assert_eq!(moved.numbers("rotation"), Ok(Some([0.0, 0.0, 1.0, 0.5])));
        assert_eq!(moved.numbers::<3>("center"), Ok(None));
        assert!(moved.numbers::<2>("translation").expect_err("three").contains("3 numbers instead of 2"));
        let cylinder = tree.node(top.children[1]);
        assert_eq!(cylinder.numbers("radius"), Ok(Some([16.0])));
        assert_eq!(cylinder.field("parts").expect("there").words, ["SIDES", "TOP"]);
        let set = tree.node(top.children[2]).field("geometry").expect("there").nodes[0];
        let coordinates = tree.node(set).field("coord").expect("there").nodes[0];
        assert_eq!(tree.node(coordinates).field("point").expect("there").numbers.len(), 6);
    }

    #[test]
    fn the_last_value_of_a_field_counts() {
        let tree = parse("Cone { height 2 bottomRadius 3 height 4 }").expect("a tree");
        assert_eq!(tree.node(tree.roots[0]).numbers("height"), Ok(Some([4.0])));
    }

    #[test]
    fn a_connection_does_not_hide_the_next_field() {
        let tree = parse("Cone { height 2 = DEF e Engine { a 1 } . out bottomRadius 3 }").expect("a tree");
        let cone = tree.node(tree.roots[0]);
        assert_eq!(cone.numbers("height"), Ok(Some([2.0])));
        assert_eq!(cone.numbers("bottomRadius"), Ok(Some([3.0])));
    }

    #[test]
    fn hostile_text_is_an_error() {
        let refused = |text: &str| parse(text).expect_err(text);
        assert!(refused(&"Group { ".repeat(10_000)).contains("inside each other"));
        assert!(refused(&format!("A {{ b {}", "C { d ".repeat(200))).contains("inside each other"));
        for text in [
            "Cube {",
            "Cube",
            "Cube { width",
            "Cube { width [ 1 2",
            "Cube { name \"a",
            "DEF",
            "DEF a",
            "A { b (",
        ] {
            assert!(refused(text).contains("ends too early"), "{text}");
        }
        assert!(refused("Cube { width 1e999 }").contains("finite"));
        assert!(refused("Cube { width -nan }").contains("finite"));
        assert!(refused("DEF a Group { USE a }").contains("no DEF before"));
        assert!(refused("}").contains("where a node"));
        assert_eq!(parse("Cube { } }").expect("one sign too many").roots.len(), 1);
        assert!(refused("PROTO A [ ] { }").contains("PROTO"));
        assert!(refused(&"A { } ".repeat(200_001)).contains("more than 200000"));
    }
}
