//! Rust source without comments, literals and tests.
//!
//! Comments and the insides of literals become blanks, line breaks stay, so that line numbers hold. This is a
//! scanner, not a parser: it knows literals, comments and braces, which is enough to find calls by name.

/// `text` with comments, strings and characters blanked.
pub(super) fn without_literals(text: &str) -> String {
    filled(text, ' ')
}

/// Lines of `text` that hold code, neither blank nor comment nor under `#[cfg(test)]`.
pub(super) fn lines_of_code(text: &str) -> usize {
    without_tests(filled(text, '"')).lines().filter(|line| !line.trim().is_empty()).count()
}

/// `text` with comments blanked, and with every visible character of strings and characters as `fill`.
fn filled(text: &str, fill: char) -> String {
    let source: Vec<char> = text.chars().collect();
    let mut out = String::with_capacity(text.len());
    let mut at = 0;
    while at < source.len() {
        let end = literal_end(&source, at).unwrap_or(at);
        if end > at {
            let fill = if source[at] == '/' { ' ' } else { fill };
            out.extend(source[at..end].iter().map(|c| if c.is_whitespace() { *c } else { fill }));
            at = end;
        } else {
            out.push(source[at]);
            at += 1;
        }
    }
    out
}

/// `text` without literals and without modules and items under `#[cfg(test)]`.
pub(super) fn shipped(text: &str) -> String {
    without_tests(without_literals(text))
}

/// `code`, which has no literals, without items under `#[cfg(test)]`.
fn without_tests(mut code: String) -> String {
    while let Some(start) = code.find("#[cfg(test)]") {
        let end = item_end(&code, start + "#[cfg(test)]".len());
        let blank: String = code[start..end].chars().map(|c| if c == '\n' { '\n' } else { ' ' }).collect();
        code.replace_range(start..end, &blank);
    }
    code
}

/// Byte index behind the item that starts at `from`: its closing brace, or its semicolon.
fn item_end(code: &str, from: usize) -> usize {
    let mut depth = 0_i32;
    for (offset, c) in code[from..].char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 1 => return from + offset + 1,
            '}' => depth -= 1,
            ';' if depth == 0 => return from + offset + 1,
            _ => {}
        }
    }
    code.len()
}

/// Index behind the comment or literal that starts at `at`, if one does.
fn literal_end(source: &[char], at: usize) -> Option<usize> {
    let next = source.get(at + 1).copied();
    match source[at] {
        '/' if next == Some('/') => Some(until(source, at, '\n')),
        '/' if next == Some('*') => Some(block_comment_end(source, at)),
        '"' => Some(string_end(source, at)),
        'r' if !continues_word(source, at) => raw_string_end(source, at),
        '\'' => character_end(source, at),
        _ => None,
    }
}

fn until(source: &[char], at: usize, stop: char) -> usize {
    source[at..].iter().position(|c| *c == stop).map_or(source.len(), |n| at + n)
}

fn block_comment_end(source: &[char], at: usize) -> usize {
    let (mut depth, mut i) = (0, at);
    while i + 1 < source.len() {
        match (source[i], source[i + 1]) {
            ('/', '*') => (depth, i) = (depth + 1, i + 2),
            ('*', '/') if depth == 1 => return i + 2,
            ('*', '/') => (depth, i) = (depth - 1, i + 2),
            _ => i += 1,
        }
    }
    source.len()
}

fn string_end(source: &[char], at: usize) -> usize {
    let mut i = at + 1;
    while i < source.len() {
        match source[i] {
            '\\' => i += 2,
            '"' => return i + 1,
            _ => i += 1,
        }
    }
    source.len()
}

fn raw_string_end(source: &[char], at: usize) -> Option<usize> {
    let hashes = source[at + 1..].iter().take_while(|c| **c == '#').count();
    if source.get(at + 1 + hashes) != Some(&'"') {
        return None;
    }
    let mut i = at + 2 + hashes;
    while i < source.len() {
        let closing =
            source[i] == '"' && source[i + 1..].iter().take(hashes).filter(|c| **c == '#').count() == hashes;
        if closing {
            return Some(i + 1 + hashes);
        }
        i += 1;
    }
    Some(source.len())
}

/// A character literal; a lifetime has no closing quote where one would be.
fn character_end(source: &[char], at: usize) -> Option<usize> {
    if source.get(at + 1) == Some(&'\\') {
        return Some(until(source, at + 3, '\'') + 1).map(|end| end.min(source.len()));
    }
    (source.get(at + 2) == Some(&'\'')).then_some(at + 3)
}

fn continues_word(source: &[char], at: usize) -> bool {
    at > 0 && (source[at - 1].is_alphanumeric() || source[at - 1] == '_') && source[at - 1] != 'b'
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_and_literals_are_blanked_and_lines_kept() {
        let text =
            "a(); // b()\n/* c() /* d() */\n e() */ f(\"g()\", r#\"h(\"\")\"#, '\"', i);\nj::<'k>('\\'');";
        let code = without_literals(text);
        assert_eq!(code.lines().count(), text.lines().count());
        for gone in ["b()", "c()", "d()", "e()", "g()", "h("] {
            assert!(!code.contains(gone), "{gone} is left in {code}");
        }
        for kept in ["a();", "f(", ", i);", "j::<'k>("] {
            assert!(code.contains(kept), "{kept} is lost from {code}");
        }
    }

    #[test]
    fn lines_of_code_are_neither_blank_nor_comments_nor_tests() {
        let text =
            "//! Head.\n\nfn a() { // b\n    c(\"\n//}\n\");\n/* d\ne */\n}\n#[cfg(test)]\nmod tests {\n}\n";
        assert_eq!(lines_of_code(text), 5);
    }

    #[test]
    fn tests_are_not_shipped() {
        let text = "fn a() {}\n#[cfg(test)]\nmod tests { fn b() { if x {} } }\nfn c() {}\n#[cfg(test)]\nmod d;\nfn e() {}";
        let code = shipped(text);
        assert!(code.contains("fn a()") && code.contains("fn c()") && code.contains("fn e()"));
        assert!(!code.contains("fn b()") && !code.contains("mod d"));
    }
}
