graph [
  directed 0
  Network "Three Cities"
  label "Three Cities"
  node [
    id 0
    label "Amsterdam"
    Longitude 4.88969
    Latitude 52.37403
    Internal 1
  ]
  node [
    id 1
    label "Bern"
    Longitude 7.44744
    Latitude 46.94809
    Internal 1
  ]
  node [
    id 2
    label "No"
    Longitude 10.74609
    Latitude 59.91273
    Internal 1
  ]
  node [
    id 3
    label "Elsewhere"
    Internal 0
  ]
  edge [
    source 0
    target 1
    LinkLabel "2.5 Gbps"
    LinkSpeedRaw 2500000000.0
  ]
  edge [
    source 0
    target 1
    LinkLabel "STM-4"
  ]
  edge [
    source 1
    target 0
    LinkLabel "dark fibre"
  ]
  edge [
    source 1
    target 2
    LinkLabel "155 Mbps"
  ]
  edge [
    source 0
    target 2
  ]
  edge [
    source 2
    target 3
  ]
]
