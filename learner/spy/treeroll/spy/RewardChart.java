package treeroll.spy;

import info.monitorenter.gui.chart.Chart2D;
import info.monitorenter.gui.chart.IAxis.AxisTitle;
import info.monitorenter.gui.chart.ITrace2D;
import info.monitorenter.gui.chart.traces.Trace2DSimple;
import java.awt.BasicStroke;
import java.awt.BorderLayout;
import java.awt.Color;
import java.awt.Component;
import java.awt.FlowLayout;
import java.util.ArrayList;
import java.util.HashMap;
import java.util.HashSet;
import java.util.LinkedHashMap;
import java.util.List;
import java.util.Map;
import java.util.Set;
import javax.swing.DefaultListCellRenderer;
import javax.swing.JComboBox;
import javax.swing.JLabel;
import javax.swing.JList;
import javax.swing.JPanel;
import treeroll.run_status_t;

/**
 * A line for each run, coloured by condition, and what the colours mean; of many runs what those of
 * a condition come to. In Swing's thread.
 */
final class RewardChart extends JPanel {
  private static final String ALL = "all conditions";
  private static final int NAMES_MAX = 20; // in the legend
  private static final BasicStroke STROKE = new BasicStroke(1.5f);
  private static final BasicStroke MEAN_STROKE = new BasicStroke(3f);
  /** Told apart by those who see no red or no green, too (Okabe and Ito). */
  static final Color[] COLOURS = {
    new Color(0x0072B2), new Color(0xD55E00), new Color(0x009E73), new Color(0xCC79A7),
    new Color(0xE69F00), new Color(0x56B4E9), new Color(0x000000)
  };

  /** Of more runs that are shown only what they come to by condition is drawn. */
  static final int LINES_MAX = 100;
  /** So many conditions, the newest ones. */
  static final int ENVELOPES_MAX = 40;
  /** They are made anew of all points. */
  private static final long ENVELOPES_EVERY_MS = 1000;

  /** How much of a run is drawn. An unknown reward is no point of the line. */
  private static final class Line {
    final ITrace2D trace = new Trace2DSimple();
    int drawn = 0;
    int timesThinned = 0;
  }

  private final StudyHistory history = new StudyHistory();
  private final Chart2D chart = new Chart2D();
  private final Map<StudyHistory.RunName, Line> lines = new HashMap<>();
  private final JComboBox<RunHistory.Measure> measure =
      new JComboBox<>(RunHistory.Measure.values());
  private final JComboBox<Object> shown = new JComboBox<>(new Object[] {ALL});
  private final JPanel legend = new JPanel(new FlowLayout(FlowLayout.LEFT));
  private final Map<StudyHistory.Group, Color> inLegend = new LinkedHashMap<>();
  private final JLabel summary = new JLabel(); // of the envelopes
  private final Set<StudyHistory.RunName> changed = new HashSet<>();
  private boolean hasEnvelopes = false;
  private long drawnAtMs = 0; // the envelopes
  private boolean saysOverflow = false;

  RewardChart() {
    super(new BorderLayout());
    chart.setPaintLabels(false); // one for each run would be thousands
    chart.getAxisX().setAxisTitle(new AxisTitle("roll-outs applied"));
    chart.getAxisY().setAxisTitle(new AxisTitle("reward"));
    chart.getAxisY().setPaintGrid(true);
    JPanel choices = new JPanel(new FlowLayout(FlowLayout.LEFT));
    choices.add(measure);
    shown.setRenderer(new GroupNames());
    choices.add(shown);
    add(choices, BorderLayout.NORTH);
    add(chart, BorderLayout.CENTER);
    add(legend, BorderLayout.SOUTH);
    measure.addActionListener(event -> drawAll());
    shown.addActionListener(event -> drawAll());
  }

  /** What is new is drawn by show(). */
  void take(run_status_t status) {
    boolean isNew = history.take(status);
    if (inLegend.size() < history.groups().size() || history.overflows() != saysOverflow) {
      writeLegend();
    }
    if (isNew) changed.add(new StudyHistory.RunName(status.learner_id, status.run));
  }

  /** Draws what has come, many runs of a condition as one envelope. */
  void show(long nowMs) {
    if (changed.isEmpty()) return;
    boolean areMany = numShown() > LINES_MAX;
    if (areMany != hasEnvelopes || areMany && nowMs - drawnAtMs >= ENVELOPES_EVERY_MS) {
      drawAll();
      drawnAtMs = nowMs;
    } else if (!areMany) {
      changed.forEach(this::draw);
      changed.clear();
    }
  }

  /** Conditions as they are called now: another learner gives all of them longer names. */
  private final class GroupNames extends DefaultListCellRenderer {
    @Override
    public Component getListCellRendererComponent(
        JList<?> list, Object value, int index, boolean isSelected, boolean hasFocus) {
      Object words = value instanceof StudyHistory.Group group ? history.nameOf(group) : value;
      return super.getListCellRendererComponent(list, words, index, isSelected, hasFocus);
    }
  }

  private boolean isShown(StudyHistory.Group group) {
    Object chosen = shown.getSelectedItem();
    return chosen == null || chosen.equals(ALL) || chosen.equals(group);
  }

  private int numShown() {
    int count = 0;
    for (StudyHistory.RunName name : history.runs().keySet()) {
      if (history.runs().get(name).size() > 0 && isShown(history.groupOf(name))) ++count;
    }
    return count;
  }

  private RunHistory.Measure measured() {
    return (RunHistory.Measure) measure.getSelectedItem();
  }

  /** Its new points; all of them where some of those that are drawn are kept no more. */
  private void draw(StudyHistory.RunName name) {
    StudyHistory.Group group = history.groupOf(name);
    if (!isShown(group)) return;
    RunHistory run = history.runs().get(name);
    Line line = lines.get(name);
    if (line != null && line.timesThinned != run.timesThinned()) {
      if (!line.trace.isEmpty()) chart.removeTrace(line.trace);
      line = null;
    }
    if (line == null) {
      line = new Line();
      line.timesThinned = run.timesThinned();
      line.trace.setColor(inLegend.get(group));
      line.trace.setStroke(STROKE);
      lines.put(name, line);
    }
    for (; line.drawn < run.size(); ++line.drawn) {
      add(line.trace, run.rolloutsAt(line.drawn), run.rewardAt(line.drawn, measured()));
    }
  }

  /** A trace joins the chart with its first point: one without would spoil the axis' scale. */
  private void add(ITrace2D trace, double rollouts, double reward) {
    if (Double.isNaN(reward)) return;
    if (trace.isEmpty()) chart.addTrace(trace);
    trace.addPoint(rollouts, reward);
  }

  private void drawAll() {
    chart.removeAllTraces();
    lines.clear();
    changed.clear();
    int count = numShown();
    hasEnvelopes = count > LINES_MAX;
    summary.setText(
        hasEnvelopes ? "lowest, mean and highest of " + count + " runs, by condition" : "");
    if (hasEnvelopes) {
      drawEnvelopes();
    } else {
      history.runs().keySet().forEach(this::draw);
    }
  }

  private void drawEnvelopes() {
    List<StudyHistory.Group> groups = new ArrayList<>();
    for (StudyHistory.Group group : history.groups()) {
      if (isShown(group)) groups.add(group);
    }
    if (groups.size() > ENVELOPES_MAX) {
      groups = groups.subList(groups.size() - ENVELOPES_MAX, groups.size());
      summary.setText(summary.getText() + ", of the newest " + ENVELOPES_MAX);
    }
    Map<StudyHistory.Group, List<RunHistory>> runs = new LinkedHashMap<>();
    groups.forEach(group -> runs.put(group, new ArrayList<>()));
    int rolloutsMax = 1;
    for (Map.Entry<StudyHistory.RunName, RunHistory> each : history.runs().entrySet()) {
      RunHistory run = each.getValue();
      List<RunHistory> alike = runs.get(history.groupOf(each.getKey()));
      if (alike == null || run.size() == 0) continue;
      alike.add(run);
      rolloutsMax = Math.max(rolloutsMax, run.rolloutsAt(run.size() - 1));
    }
    for (Map.Entry<StudyHistory.Group, List<RunHistory>> each : runs.entrySet()) {
      Envelope envelope = new Envelope(rolloutsMax);
      for (RunHistory run : each.getValue()) envelope.add(run, measured());
      draw(envelope, inLegend.get(each.getKey()));
    }
  }

  private void draw(Envelope envelope, Color colour) {
    ITrace2D[] traces = {new Trace2DSimple(), new Trace2DSimple(), new Trace2DSimple()};
    for (ITrace2D trace : traces) {
      trace.setColor(colour);
      trace.setStroke(STROKE);
    }
    traces[1].setStroke(MEAN_STROKE);
    for (int place = 0; place < envelope.places(); ++place) {
      if (envelope.isEmpty(place)) continue;
      double rollouts = envelope.rolloutsAt(place);
      add(traces[0], rollouts, envelope.lowestAt(place));
      add(traces[1], rollouts, envelope.meanAt(place));
      add(traces[2], rollouts, envelope.highestAt(place));
    }
  }

  private void writeLegend() {
    for (StudyHistory.Group group : history.groups()) {
      if (inLegend.containsKey(group)) continue;
      inLegend.put(group, COLOURS[inLegend.size() % COLOURS.length]);
      shown.addItem(group);
    }
    saysOverflow = history.overflows();
    legend.removeAll();
    inLegend.entrySet().stream()
        .limit(NAMES_MAX)
        .forEach(
            entry -> {
              JLabel label = new JLabel("\u2014 " + history.nameOf(entry.getKey()));
              label.setForeground(entry.getValue());
              legend.add(label);
            });
    if (inLegend.size() > NAMES_MAX) legend.add(new JLabel("\u2026"));
    if (saysOverflow) legend.add(new JLabel("more runs speak than are drawn"));
    legend.add(summary);
    legend.revalidate();
    legend.repaint();
    shown.repaint();
  }
}
