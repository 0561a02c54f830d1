package treeroll.spy;

import java.awt.Container;
import java.awt.event.ActionEvent;
import java.io.IOException;
import java.util.regex.Pattern;
import javax.swing.AbstractAction;
import javax.swing.Action;
import javax.swing.JDesktopPane;
import javax.swing.JInternalFrame;
import javax.swing.Timer;
import javax.swing.event.InternalFrameAdapter;
import javax.swing.event.InternalFrameEvent;
import lcm.lcm.LCM;
import lcm.lcm.LCMDataInputStream;
import lcm.lcm.LCMSubscriber;
import lcm.spy.ChannelData;
import lcm.spy.SpyPlugin;
import treeroll.run_status_t;

/** What lcm-spy offers on a channel of run_status_t: "Reward by run". It finds this class itself. */
public final class RewardPlugin implements SpyPlugin {
  static final String TITLE = "Reward by run";
  private static final int DRAW_EVERY_MS = 100;

  @Override
  public boolean canHandle(long fingerprint) {
    return fingerprint == run_status_t.LCM_FINGERPRINT;
  }

  @Override
  public Action getAction(JDesktopPane desktop, ChannelData channel) {
    return new AbstractAction(TITLE) {
      @Override
      public void actionPerformed(ActionEvent event) {
        JInternalFrame frame = new JInternalFrame(channel.name, true, true, true);
        Runnable leave = listen(channel.name, frame.getContentPane());
        frame.addInternalFrameListener(
            new InternalFrameAdapter() {
              @Override
              public void internalFrameClosed(InternalFrameEvent closed) {
                leave.run();
              }
            });
        desktop.add(frame);
        frame.setSize(780, 540);
        frame.setVisible(true);
      }
    };
  }

  /**
   * Draws what comes on a channel from now on. Learners say it again every few seconds.
   *
   * @return what ends it
   */
  static Runnable listen(String channel, Container place) {
    RewardChart chart = new RewardChart();
    place.add(chart);
    Inbox inbox = new Inbox();
    Timer timer =
        new Timer(
            DRAW_EVERY_MS,
            event -> {
              inbox.drain(chart::take);
              chart.show(System.nanoTime() / 1_000_000);
            });
    LCMSubscriber subscriber = (lcm, name, bytes) -> take(inbox, bytes);
    String pattern = Pattern.quote(channel);
    LCM.getSingleton().subscribe(pattern, subscriber);
    timer.start();
    return () -> {
      LCM.getSingleton().unsubscribe(pattern, subscriber);
      timer.stop();
    };
  }

  /** In LCM's thread. */
  private static void take(Inbox inbox, LCMDataInputStream bytes) {
    try {
      inbox.put(new run_status_t(bytes));
    } catch (IOException | RuntimeException notOurs) {
      // Of another version: lcm-spy's table counts it as an error.
    }
  }
}
