//! The HTML around texts, tables and charts. Everything that comes from files is escaped here.

use serde_json::Value;

/// The script that draws the charts (assets/README.md).
const PLOTLY: &str = include_str!("../../assets/plotly-gl3d.min.js");

const STYLE: &str = "body{font:16px/1.5 sans-serif;max-width:1200px;margin:auto;padding:0 1em;color:#222}\
h1,h2{line-height:1.2}nav a{margin-right:1em}table{border-collapse:collapse;font-size:14px}\
td,th{padding:.2em .7em;border-bottom:1px solid #ddd;text-align:right}td:first-child,th:first-child{text-align:left}\
.scroll{overflow-x:auto}.chart{width:100%;height:420px}.tall{height:640px}.grid{display:grid;\
grid-template-columns:repeat(auto-fill,minmax(360px,1fr))}.grid .chart{height:330px}.note{color:#555;font-size:14px}\
.long td,.long th{text-align:left}.long td{overflow-wrap:anywhere}.long td:first-child{white-space:nowrap}.keys span{margin-right:1em;white-space:nowrap}";

/// What every chart of the page is drawn with.
const DRAW: &str =
    "function draw(id,chart){Plotly.react(id,chart.data,chart.layout,{responsive:true,displaylogo:false});}";

/// A page being written.
pub struct Page {
    title: String,
    body: String,
    contents: String,
    charts: usize,
}

/// Text with the characters that HTML and the labels of plotly.js reserve replaced; not for attributes.
pub fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            _ => out.push(letter),
        }
    }
    out
}

/// JSON that may stand within a script.
pub fn scripted(value: &Value) -> String {
    value.to_string().replace('<', "\\u003c")
}

impl Page {
    pub fn new(title: &str) -> Self {
        Self { title: escaped(title), body: String::new(), contents: String::new(), charts: 0 }
    }

    /// Begins a section.
    pub fn section(&mut self, title: &str) {
        let anchor: String = title.chars().filter(char::is_ascii_alphanumeric).collect();
        self.contents.push_str(&format!("<a href=\"#{anchor}\">{title}</a>"));
        self.body.push_str(&format!("<h2 id=\"{anchor}\">{title}</h2>\n"));
    }

    /// A paragraph of plain text.
    pub fn text(&mut self, text: &str) {
        self.body.push_str(&format!("<p>{}</p>\n", escaped(text)));
    }

    /// A paragraph in small print.
    pub fn note(&mut self, text: &str) {
        self.body.push_str(&format!("<p class=\"note\">{}</p>\n", escaped(text)));
    }

    /// A list of plain texts.
    pub fn list(&mut self, items: &[String]) {
        let items: String = items.iter().map(|item| format!("<li>{}</li>", escaped(item))).collect();
        self.body.push_str(&format!("<ul>{items}</ul>\n"));
    }

    /// A table of plain texts; `class` is "" or "long" for columns of text.
    pub fn table(&mut self, class: &str, head: &[String], rows: &[Vec<String>]) {
        let row = |cells: &[String], tag: &str| {
            let cells: String =
                cells.iter().map(|cell| format!("<{tag}>{}</{tag}>", escaped(cell))).collect();
            format!("<tr>{cells}</tr>")
        };
        let body: String = rows.iter().map(|cells| row(cells, "td")).collect();
        let head = if head.is_empty() { String::new() } else { row(head, "th") };
        self.body.push_str(&format!(
            "<div class=\"scroll\"><table class=\"{class}\">{head}{body}</table></div>\n"
        ));
    }

    /// A chart, as `{"data": …, "layout": …}` of plotly.js; `class` is "" or "tall".
    pub fn chart(&mut self, class: &str, chart: &Value) {
        let id = self.place(class);
        self.body.push_str(&format!("<script>draw(\"{id}\",{})</script>\n", scripted(chart)));
    }

    /// Names of series with their colours, for charts without legends of their own.
    pub fn legend<'a>(&mut self, names: impl Iterator<Item = (&'a str, &'a str)>) {
        let keys: String = names
            .map(|(name, color)| format!("<span><b style=\"color:{color}\">■</b> {}</span>", escaped(name)))
            .collect();
        self.body.push_str(&format!("<p class=\"note keys\">{keys}</p>\n"));
    }

    /// Charts side by side.
    pub fn charts(&mut self, charts: &[Value]) {
        self.body.push_str("<div class=\"grid\">");
        charts.iter().for_each(|chart| self.chart("", chart));
        self.body.push_str("</div>\n");
    }

    /// Sets of charts of which one is shown, chosen by name.
    pub fn choice(&mut self, sets: &[(String, Vec<Value>)]) {
        let select = self.select(sets.iter().map(|(name, _)| name.as_str()));
        let count = sets.first().map_or(0, |(_, charts)| charts.len());
        let ids: Vec<String> = (0..count).map(|_| self.place("")).collect();
        let charts: Vec<Value> = sets.iter().map(|(_, charts)| Value::from(charts.clone())).collect();
        let show = format!(
            "{}.forEach((id,i)=>draw(id,sets[select.selectedIndex][i]))",
            scripted(&Value::from(ids))
        );
        self.on_choice(&select, &charts, &show);
    }

    /// A tall chart, to whose data those of a set are added, chosen by name. What the reader turned stays turned.
    pub fn chart_with_choice(&mut self, chart: &Value, sets: &[(String, Vec<Value>)]) {
        let select = self.select(sets.iter().map(|(name, _)| name.as_str()));
        let id = self.place("tall");
        let traces: Vec<Value> = sets.iter().map(|(_, traces)| Value::from(traces.clone())).collect();
        let show = format!(
            "{{const chart={};draw(\"{id}\",{{data:chart.data.concat(sets[select.selectedIndex]),layout:chart.layout}})}}",
            scripted(chart)
        );
        self.on_choice(&select, &traces, &show);
    }

    /// A list of names to choose from; its id.
    fn select<'a>(&mut self, names: impl Iterator<Item = &'a str>) -> String {
        self.charts += 1;
        let id = format!("select{}", self.charts);
        let options: String = names.map(|name| format!("<option>{}</option>", escaped(name))).collect();
        self.body.push_str(&format!("<p><select id=\"{id}\">{options}</select></p>\n"));
        id
    }

    /// Runs `show`, which knows `sets` and `select`, now and at every choice.
    fn on_choice(&mut self, select: &str, sets: &[Value], show: &str) {
        self.body.push_str(&format!(
            "<script>{{const sets={},select=document.getElementById(\"{select}\"),show=()=>{show};\
             select.onchange=show;show();}}</script>\n",
            scripted(&Value::from(sets)),
        ));
    }

    /// Data for programs that read the page.
    pub fn data(&mut self, id: &str, value: &Value) {
        self.body.push_str(&format!(
            "<script type=\"application/json\" id=\"{id}\">{}</script>\n",
            scripted(value)
        ));
    }

    /// An empty place for a chart; its id.
    fn place(&mut self, class: &str) -> String {
        self.charts += 1;
        let id = format!("chart{}", self.charts);
        self.body.push_str(&format!("<div id=\"{id}\" class=\"chart {class}\"></div>\n"));
        id
    }

    /// The whole document.
    pub fn finish(self) -> String {
        let Self { title, body, contents, .. } = self;
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"generator\" content=\"sonel-analyze report\">\
             <title>{title}</title>\n<style>{STYLE}</style>\n<script>{PLOTLY}</script>\n<script>{DRAW}</script></head>\n\
             <body><h1>{title}</h1>\n<nav>{contents}</nav>\n{body}</body></html>\n"
        )
    }
}
