#include "server/formats/nets/dot.h"

#include <algorithm>
#include <cassert>
#include <map>

#include "server/formats/nets/pnml_xml.h"

namespace pheromone::nets {
namespace {

using petri::Arc;
using petri::Marking;
using petri::Net;
using petri::Place;
using petri::Transition;

constexpr const char* kMore = "#b7e1c0";   // a cell with more tokens than before
constexpr const char* kFewer = "#f6c9b6";  // with fewer

template <typename Node>
const std::string& TitleOf(const Node& node) {
  return node.name.empty() ? node.id : node.name;
}

// In a label, Graphviz reads entities as XML does.
std::string DotEscaped(const std::string& text) {
  std::string escaped;
  AppendText(text, &escaped);
  return escaped;
}

// A string in double quotes, in which a backslash begins an escape.
std::string DotString(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : DotEscaped(text)) {
    if (c == '\n') {
      quoted += "\\n";
    } else {
      quoted += c == '"' || c == '\\' ? std::string{'\\', c} : std::string{c};
    }
  }
  return quoted + '"';
}

std::string TokensText(uint32_t tokens) {
  constexpr uint32_t kMaxDots = 3;
  std::string dots;
  for (uint32_t i = 0; i < tokens && tokens <= kMaxDots; ++i) {
    dots += dots.empty() ? "●" : " ●";
  }
  return tokens > kMaxDots ? std::to_string(tokens) : dots;
}

void AppendEdge(const std::string& from, const std::string& to, uint32_t weight,
                const std::string& style, std::string* dot) {
  std::string attributes = style;
  if (weight != 1) {
    attributes += (style.empty() ? "" : ", ") + ("label=\"" + std::to_string(weight) + "\"");
  }
  *dot += "  " + from + " -> " + to + (attributes.empty() ? "" : " [" + attributes + "]") + ";\n";
}

// Names are inside, because what is written beside a node (xlabel) may be crossed by arcs.
std::string PlaceNode(size_t number, const Place& place) {
  std::string label = DotString(TitleOf(place));
  label.insert(label.size() - 1, "\\n" + TokensText(place.tokens));
  return "p" + std::to_string(number) + " [label=" + label +
         (place.box.empty() ? "" : ", peripheries=2, tooltip=" + DotString("box " + place.box)) +
         "];\n";
}

std::string TransitionNode(size_t number, const Transition& transition) {
  return "t" + std::to_string(number) +
         " [shape=box, fillcolor=\"#2b3440\", fontcolor=white, height=0.2, "
         "margin=\"0.08,0.02\", label=" +
         DotString(TitleOf(transition)) + "];\n";
}

void AppendArcs(size_t number, const Transition& transition, std::string* dot) {
  const std::string name = "t" + std::to_string(number);
  const auto place_name = [](const Arc& arc) { return "p" + std::to_string(arc.place); };
  const auto is_in = [](const std::vector<Arc>& arcs, const Arc& arc) {
    return std::find(arcs.begin(), arcs.end(), arc) != arcs.end();
  };
  for (const Arc& arc : transition.takes) {
    AppendEdge(place_name(arc), name, arc.weight, is_in(transition.gives, arc) ? "dir=both" : "",
               dot);
  }
  for (const Arc& arc : transition.gives) {
    if (!is_in(transition.takes, arc)) {
      AppendEdge(name, place_name(arc), arc.weight, "", dot);
    }
  }
  for (const Arc& arc : transition.reads) {
    AppendEdge(place_name(arc), name, arc.weight, "style=dashed, arrowhead=none", dot);
  }
  for (const Arc& arc : transition.inhibitors) {
    AppendEdge(place_name(arc), name, arc.weight, "arrowhead=odot, arrowsize=1", dot);
  }
}

std::vector<Marking> MarkingsOf(const Net& net, const std::vector<uint32_t>& transitions) {
  std::vector<Marking> markings = {InitialMarking(net)};
  for (const uint32_t transition : transitions) {
    assert(IsEnabled(net, transition, markings.back()));
    markings.push_back(Fire(net, transition, markings.back()));
  }
  return markings;
}

std::string Cell(int32_t tokens, int32_t before) {
  const char* colour = tokens > before ? kMore : tokens < before ? kFewer : nullptr;
  return std::string("<td") +
         (colour == nullptr ? "" : " bgcolor=\"" + std::string(colour) + "\"") + ">" +
         (tokens == 0 && colour == nullptr ? " " : std::to_string(tokens)) + "</td>";
}

// What has tokens throughout and never other ones.
std::string ConstantText(const Net& net, const std::vector<bool>& changes) {
  std::string text;
  for (size_t place = 0; place < net.places.size(); ++place) {
    const Place& it = net.places[place];
    if (!changes[place] && it.tokens > 0) {
      text += (text.empty() ? "" : ", ") + DotEscaped(it.id) +
              (it.tokens == 1 ? "" : " " + std::to_string(it.tokens));
    }
  }
  return text;
}

}  // namespace

std::string DotOfNet(const Net& net) {
  std::string dot = "digraph net {\n  label=" + DotString(net.name) +
                    ";\n  nodesep=0.35;\n  ranksep=0.35;\n"
                    "  fontname=\"Helvetica\";\n  fontsize=12;\n"
                    "  node [shape=ellipse, style=filled, fillcolor=white, width=0.5, height=0.5, "
                    "margin=\"0.02,0.02\", fontname=\"Helvetica\", "
                    "fontsize=10];\n"
                    "  edge [arrowsize=0.7, fontname=\"Helvetica\", fontsize=10];\n";
  std::map<std::string, std::string> nodes;  // by owner
  for (size_t i = 0; i < net.places.size(); ++i) {
    nodes[net.places[i].owner] += "    " + PlaceNode(i, net.places[i]);
  }
  for (size_t i = 0; i < net.transitions.size(); ++i) {
    nodes[net.transitions[i].owner] += "    " + TransitionNode(i, net.transitions[i]);
  }
  size_t clusters = 0;
  for (const auto& [owner, lines] : nodes) {
    if (owner.empty()) {
      dot += lines;
      continue;
    }
    dot += "  subgraph cluster_" + std::to_string(clusters++) +
           " {\n    label=" + DotString(owner) +
           ";\n    style=\"rounded,filled\";\n    color=\"#8899aa\";\n    fillcolor=\"#f2f5f8\";\n"
           "    margin=14;\n" +
           lines + "  }\n";
  }
  for (size_t i = 0; i < net.transitions.size(); ++i) {
    AppendArcs(i, net.transitions[i], &dot);
  }
  return dot + "}\n";
}

std::string DotOfTrace(const Net& net, const std::vector<uint32_t>& transitions) {
  const std::vector<Marking> markings = MarkingsOf(net, transitions);
  std::vector<bool> changes(net.places.size());
  for (const Marking& marking : markings) {
    for (size_t place = 0; place < changes.size(); ++place) {
      const auto at = static_cast<Eigen::Index>(place);
      changes[place] = changes[place] || marking[at] != markings[0][at];
    }
  }
  std::string dot =
      "digraph trace {\n  label=" + DotString(net.name) +
      ";\n  labelloc=t;\n  fontname=\"Helvetica\";\n  node [shape=plain, fontname=\"Helvetica\", "
      "fontsize=11];\n  trace [label=<\n<table border=\"0\" cellborder=\"1\" cellspacing=\"0\" "
      "cellpadding=\"4\" color=\"#b0b8c0\">\n<tr><td></td><td align=\"left\"><b>fired</b></td>";
  size_t columns = 2;
  for (size_t place = 0; place < changes.size(); ++place) {
    if (changes[place]) {
      dot += "<td>" + DotEscaped(net.places[place].id) + "</td>";
      ++columns;
    }
  }
  for (size_t row = 0; row < markings.size(); ++row) {
    const std::string title =
        row == 0 ? "<i>initially</i>" : DotEscaped(net.transitions[transitions[row - 1]].id);
    dot += "</tr>\n<tr><td align=\"right\">" + std::to_string(row) + "</td><td align=\"left\">" +
           title + "</td>";
    const Marking& before = markings[row == 0 ? 0 : row - 1];
    for (size_t place = 0; place < changes.size(); ++place) {
      const auto at = static_cast<Eigen::Index>(place);
      dot += changes[place] ? Cell(markings[row][at], before[at]) : "";
    }
  }
  dot += "</tr>\n";
  if (const std::string constant = ConstantText(net, changes); !constant.empty()) {
    dot += "<tr><td border=\"0\" align=\"left\" colspan=\"" + std::to_string(columns) +
           "\">unchanged: " + constant + "</td></tr>\n";
  }
  return dot + "</table>>];\n}\n";
}

}  // namespace pheromone::nets
