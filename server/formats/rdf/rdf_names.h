// The IRIs of what a fact in RDF consists of (server/core/tags/README.md, "RDF").
#pragma once

#include <string_view>

namespace pheromone::ctl {

inline constexpr std::string_view kRdfType = "http://www.w3.org/1999/02/22-rdf-syntax-ns#type";
inline constexpr std::string_view kRdfStatement =
    "http://www.w3.org/1999/02/22-rdf-syntax-ns#Statement";
inline constexpr std::string_view kRdfSubject =
    "http://www.w3.org/1999/02/22-rdf-syntax-ns#subject";
inline constexpr std::string_view kRdfPredicate =
    "http://www.w3.org/1999/02/22-rdf-syntax-ns#predicate";
inline constexpr std::string_view kRdfObject = "http://www.w3.org/1999/02/22-rdf-syntax-ns#object";
inline constexpr std::string_view kRobTag = "http://robots.org/ns#tag";
inline constexpr std::string_view kRobRobotId = "http://robots.org/ns#robotId";
inline constexpr std::string_view kRobDtime = "http://robots.org/ns#dtime";

}  // namespace pheromone::ctl
