// Turns the embedded data into dygraphs plots. A point that only another series has is null (the line goes on), a
// gap of its own is not a number (the line breaks).
(function () {
  'use strict';
  var light = ['#0b62a4', '#c2410c', '#15803d', '#7c3aed', '#b4233c', '#0f766e', '#8a6d00', '#525c69', '#a21caf'];
  var dark = ['#6db3f2', '#fb923c', '#4ade80', '#c4a6ff', '#ff8fa0', '#5ee0d0', '#e3c44b', '#b3bdc9', '#ea8df5'];
  var scheme = window.matchMedia('(prefers-color-scheme: dark)');

  function css(name) { return getComputedStyle(document.documentElement).getPropertyValue(name).trim(); }

  function escaped(text) {
    var holder = document.createElement('span');
    holder.textContent = text;
    return holder.innerHTML;
  }

  function number(value) {
    var size = Math.abs(value);
    if (value === 0) return '0';
    if (size >= 1e-3 && size < 1e6) return String(parseFloat(value.toPrecision(6)));
    return value.toExponential(3).replace(/\.?0+e/, 'e').replace('e+', 'e');
  }

  // Whole decades; between two neighbours also 2 and 5 of each.
  function decades(low, high) {
    var ticks = [];
    var digits = Math.log10(high / low) < 2.5 ? [1, 2, 5] : [1];
    for (var power = Math.floor(Math.log10(low)); power <= Math.ceil(Math.log10(high)); ++power) {
      digits.forEach(function (digit) {
        var v = parseFloat(digit + 'e' + power);
        if (v >= low && v <= high) ticks.push({ v: v, label: number(v) });
      });
    }
    return ticks;
  }

  // Room around the outermost points of a logarithmic axis: a factor, as dygraphs pads in pixels of linear ones only.
  function padded(values) {
    var positive = values.filter(function (value) { return value > 0; });
    var low = Math.min.apply(null, positive), high = Math.max.apply(null, positive);
    var room = Math.max(Math.pow(high / low, 0.04), 1.15);
    return [low / room, high * room];
  }

  function all(plot, fields) {
    return [].concat.apply([], plot.series.map(function (series) {
      return [].concat.apply([], fields.map(function (field) { return series[field]; }));
    }));
  }

  function rows(plot) {
    var byX = new Map();
    plot.series.forEach(function (series, column) {
      series.x.forEach(function (x, i) {
        if (!byX.has(x)) byX.set(x, new Array(plot.series.length).fill(null));
        var y = series.y[i] === null ? NaN : series.y[i];
        if (plot.bands) y = series.lower.length ? [series.lower[i], y, series.upper[i]] : [y, y, y];
        byX.get(x)[column] = y;
      });
    });
    return Array.from(byX.keys()).sort(function (a, b) { return a - b; }).map(function (x) {
      return [x].concat(byX.get(x));
    });
  }

  // A name has one colour in all plots of the page: its place in the order in which names come first. Where that would be
  // another's in the same plot, as there are more names than colours, it is the next free one.
  var places = new Map();
  function places_of(plot) {
    var taken = new Set();
    return plot.series.map(function (series) {
      if (!places.has(series.name)) places.set(series.name, places.size % light.length);
      var place = places.get(series.name);
      while (taken.has(place) && taken.size < light.length) place = (place + 1) % light.length;
      taken.add(place);
      return place;
    });
  }

  function colours(plot) {
    var palette = scheme.matches ? dark : light;
    return { colors: places_of(plot).map(function (place) { return palette[place]; }), axisLineColor: css('--line'),
             gridLineColor: css('--grid') };
  }

  function draw(plot, index) {
    var steps = plot.style === 'steps';
    var options = {
      labels: [plot.x_label].concat(plot.series.map(function (series) { return series.name; })),
      xlabel: escaped(plot.x_label), ylabel: escaped(plot.y_label),
      legend: 'always', labelsDiv: 'legend' + index, labelsSeparateLines: false,
      customBars: plot.bands, connectSeparatedPoints: plot.series.length > 1,
      stepPlot: steps, fillGraph: steps, includeZero: steps, fillAlpha: plot.bands ? 0.18 : 0.45,
      drawPoints: plot.style === 'points', pointSize: 2.5, strokeWidth: plot.style === 'line' ? 1.1 : 1.6,
      logscale: plot.log_y, xRangePad: plot.log_x ? 0 : 4, yRangePad: plot.log_y ? 0 : 8,
      animatedZooms: false, resizable: false,
      axes: {
        x: { logscale: plot.log_x, axisLabelFormatter: number, valueFormatter: number, pixelsPerLabel: 70 },
        y: { axisLabelFormatter: number, valueFormatter: number, axisLabelWidth: 74, pixelsPerLabel: 32 }
      }
    };
    if (plot.log_x) {
      options.dateWindow = padded(all(plot, ['x']));
      options.axes.x.ticker = decades;
    }
    if (plot.log_y) {
      options.valueRange = padded(all(plot, ['y', 'lower', 'upper']));
    } else if (plot.y_extent > 0) {
      options.valueRange = [-1.1 * plot.y_extent, 1.1 * plot.y_extent];
      options.axes.y.ticker = decades;
    }
    Object.assign(options, colours(plot));
    return new Dygraph(document.getElementById('plot' + index), rows(plot), options);
  }

  var plots = JSON.parse(document.getElementById('plots').textContent);
  var graphs = plots.map(draw);
  scheme.addEventListener('change', function () {
    graphs.forEach(function (graph, i) { graph.updateOptions(colours(plots[i])); });
  });
})();
