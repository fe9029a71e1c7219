//! Equations of joints that follow others: `JF1/3+0.8727`.

/// The name in an equation, and constant and multiplier of its line.
///
/// # Errors
/// It has several names, none, no known syntax, or is no line.
pub(super) fn line(text: &str) -> Result<(String, [f64; 2]), String> {
    let mut names: Vec<String> = Vec::new();
    let mut at = |x: f64| {
        let mut parser = Parser { rest: text, x, names: &mut names, depth: 0 };
        let value = parser.sum()?;
        match parser.rest.trim().is_empty() {
            true if value.is_finite() => Ok(value),
            true => Err("has no finite value".to_owned()),
            false => Err(format!("has '{}' where + - * / ( ) ^ or a number are valid", parser.rest.trim())),
        }
    };
    let [a, b, c] = [at(0.0)?, at(1.0)?, at(2.0)?];
    names.dedup();
    match names.as_slice() {
        [one] if (c - b - (b - a)).abs() <= 1e-9 * (1.0 + b.abs()) => Ok((one.clone(), [a, b - a])),
        [_] => Err("is no line of the other joint's value".to_owned()),
        [] => Err("names no joint".to_owned()),
        _ => Err(format!("names several joints: {}", names.join(", "))),
    }
}

struct Parser<'a, 'n> {
    rest: &'a str,
    /// The value of the name.
    x: f64,
    names: &'n mut Vec<String>,
    depth: usize,
}

impl Parser<'_, '_> {
    fn taken(&mut self, symbol: char) -> bool {
        self.rest = self.rest.trim_start();
        let rest = self.rest.strip_prefix(symbol);
        self.rest = rest.unwrap_or(self.rest);
        rest.is_some()
    }

    fn sum(&mut self) -> Result<f64, String> {
        let mut value = self.product()?;
        loop {
            if self.taken('+') {
                value += self.product()?;
            } else if self.taken('-') {
                value -= self.product()?;
            } else {
                return Ok(value);
            }
        }
    }

    fn product(&mut self) -> Result<f64, String> {
        let mut value = self.power()?;
        loop {
            if self.taken('*') {
                value *= self.power()?;
            } else if self.taken('/') {
                value /= self.power()?;
            } else {
                return Ok(value);
            }
        }
    }

    fn power(&mut self) -> Result<f64, String> {
        const DEEPEST: usize = 32;
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err("has too many parts inside each other".to_owned());
        }
        let value = if self.taken('-') { -self.power()? } else { self.value()? };
        let value = if self.taken('^') { value.powf(self.power()?) } else { value };
        self.depth -= 1;
        Ok(value)
    }

    fn value(&mut self) -> Result<f64, String> {
        if self.taken('(') {
            let value = self.sum()?;
            return if self.taken(')') { Ok(value) } else { Err("has no ')' to its '('".to_owned()) };
        }
        let is_name = |c: char| c.is_alphanumeric() || c == '_';
        let first = self.rest.chars().next().unwrap_or(' ');
        let end = if first.is_ascii_digit() || first == '.' {
            let exponent = |k: usize| self.rest[..k].ends_with(['e', 'E']);
            let number = |(k, c): &(usize, char)| {
                c.is_ascii_digit() || matches!(c, '.' | 'e' | 'E') || (matches!(c, '+' | '-') && exponent(*k))
            };
            self.rest.char_indices().find(|place| !number(place)).map_or(self.rest.len(), |(k, _)| k)
        } else {
            self.rest.find(|c| !is_name(c)).unwrap_or(self.rest.len())
        };
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        if first.is_ascii_digit() || first == '.' {
            return word.parse().map_err(|_| format!("has '{word}', which is no number"));
        }
        if word.is_empty() {
            return Err("ends, or has a sign, where a number or a name is valid".to_owned());
        }
        if self.rest.trim_start().starts_with('(') {
            return Err(format!("has the function {word}"));
        }
        if !self.names.iter().any(|name| name == word) {
            self.names.push(word.to_owned());
        }
        Ok(self.x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_one_joint_are_read() {
        for (text, name, constant, multiplier) in [
            ("JF1/3+0.8727", "JF1", 0.8727, 1.0 / 3.0),
            ("-j", "j", 0.0, -1.0),
            ("0.5*(a_1 - 1e-1)", "a_1", -0.05, 0.5),
            (" 1.5 * j * 2^2 ", "j", 0.0, 6.0),
        ] {
            let (found, [c, m]) = line(text).unwrap_or_else(|problem| panic!("{text}: {problem}"));
            assert!(
                found == name && (c - constant).abs() < 1e-12 && (m - multiplier).abs() < 1e-12,
                "{text}: {c} {m}"
            );
        }
    }

    #[test]
    fn what_is_no_line_of_one_joint_is_said() {
        for (text, words) in [
            ("j^2", "no line"),
            ("a+b", "several joints: a, b"),
            ("1.5", "names no joint"),
            ("sin(j)", "the function sin"),
            ("(j", "no ')'"),
            ("j+", "ends"),
            ("j ? 1", "has '? 1'"),
            ("1/j", "no finite value"),
            ("", "ends"),
        ] {
            let problem = line(text).expect_err(text);
            assert!(problem.contains(words), "{text}: {problem}");
        }
        assert!(line(&"(".repeat(100)).is_err());
    }
}
