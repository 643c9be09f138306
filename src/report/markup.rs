//! Small pieces of HTML that every section uses; all text goes through [`escape`].

use crate::base::Status;

/// Text that can stand between tags and inside a quoted attribute.
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            // A page may not hold control characters, nor may a name break a line.
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

/// A section with its heading and a sentence that says what it shows.
pub fn section(id: &str, heading: &str, lead: &str, content: &str) -> String {
    let lead = if lead.is_empty() {
        String::new()
    } else {
        format!("<p class=\"lead\">{lead}</p>\n")
    };
    format!(
        "<section id=\"{id}\" aria-labelledby=\"{id}-h\">\n<h2 id=\"{id}-h\">{heading}</h2>\n{lead}{content}</section>\n"
    )
}

/// Whether a number was measured, as a badge that also differs in shape.
pub fn badge(status: Status) -> &'static str {
    match status {
        Status::Measured => "<span class=\"badge measured\">measured</span>",
        Status::Assumed => "<span class=\"badge assumed\">assumed</span>",
        Status::Known => "<span class=\"badge known\">known</span>",
    }
}

/// A list of names: the first few in sight, the others behind a summary.
pub fn names(names: &[String]) -> String {
    let shown: Vec<String> = names.iter().map(|n| escape(n)).collect();
    match shown.len() {
        0 => "<span class=\"muted\">–</span>".to_owned(),
        1..=2 => shown.join(", "),
        n => format!(
            "<details class=\"more\"><summary>{n} interactions</summary>{}</details>",
            shown.join(", ")
        ),
    }
}

/// A table that scrolls sideways where it does not fit.
pub fn table(label: &str, class: &str, head: &[&str], rows: &str) -> String {
    let head: String = head.iter().map(|h| format!("<th scope=\"col\">{h}</th>")).collect();
    format!(
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{}\"><table class=\"{class}\"><thead><tr>{head}</tr></thead>\n\
         <tbody>\n{rows}</tbody></table></div>\n",
        escape(label)
    )
}

/// A probability in words: never 0 % nor 100 %, since no data prove that.
pub fn percent(probability: f64) -> String {
    if !probability.is_finite() {
        "–".to_owned()
    } else if probability > 0.999 {
        "&gt; 99.9 %".to_owned()
    } else if probability < 0.001 {
        "&lt; 0.1 %".to_owned()
    } else if (0.1..0.99).contains(&probability) {
        format!("{:.0} %", 100.0 * probability)
    } else {
        format!("{:.1} %", 100.0 * probability)
    }
}

/// A count with its noun.
pub fn count(n: usize, one: &str, many: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { many })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_in_a_name_stays_text() {
        assert_eq!(escape("<b a=\"x\">&'\n"), "&lt;b a=&quot;x&quot;&gt;&amp;&#39; ");
    }

    #[test]
    fn no_probability_is_shown_as_certain() {
        assert_eq!(percent(1.0), "&gt; 99.9 %");
        assert_eq!(percent(0.98), "98 %");
        assert_eq!(percent(0.0), "&lt; 0.1 %");
    }
}
